"""The table of a bake's options, and one bake's settings by it: validated, for all front doors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .choices import ASSEMBLIES, ATLASES, FORMATS, LIGHTS, METHOD_CHOICES, QUALITIES, QUANTITIES
from .combinations import check_combinations
from .constants import MAX_RESOLUTION
from .methods import ALL, ITERATIVE, LINKS, MATRIX
from .option_record import UNBOUNDED, Choice, PanelRow, option, options_of

MOST = 10_000_000
"""Elements, patches: what no machine has room for need not be tried."""

GroupSetting = tuple[str, tuple[str, ...]]
"""A light group: its name, and the names of its lamps, emissive materials and the world."""

AS_A_WHOLE = (("size_mode", "resolution"),)
BY_DENSITY = (("size_mode", "density"),)
BY_ERROR = "error"
"""The panel's choice of a quality for which the error below decides."""


@dataclass(frozen=True, repr=False)
class BakeSettings:
    """One bake's settings, as the command line and the panel both give them: each field is an option.

    Settings of the method that are None come from the quality. The order of fields is part of the digests in
    users' files: new ones go last.

    Raises
    ------
    UsageError
        If a value is out of its range, a setting does not apply to the method, or two of them do not go
        together.
    """

    resolution: int = option(
        512,
        "Width and height of a lightmap in pixels",
        "Size",
        limits=(1, MAX_RESOLUTION),
        unit="pixels",
        preset=True,
        panel=PanelRow("Resolution", soft_low=64, soft_high=4096, subtype="PIXEL", only_if=AS_A_WHOLE),
    )
    texel_density: float | None = option(
        None,
        "Lightmap pixels along one meter of surface; the size of the lightmap follows",
        "Size",
        metavar="PX_PER_M",
        limits=(0, 1e9),
        above=True,
        unit="pixels a meter",
        instead_of="resolution",
        preset=True,
        panel=PanelRow(
            "Pixels per Meter",
            default=64.0,
            low=0.01,
            soft_low=1.0,
            soft_high=1024.0,
            precision=2,
            only_if=BY_DENSITY,
        ),
    )
    atlas: str = option(
        "shared",
        "How objects share images",
        "Pages",
        choices=ATLASES,
        panel=PanelRow("Atlas"),
    )
    pages: int = option(
        1,
        "How many images the objects of a shared atlas are distributed over; a density decides this itself",
        "Pages",
        limits=(1, 64),
        panel=PanelRow("Pages", soft_high=16, only_if=(("atlas", "shared"), *AS_A_WHOLE)),
    )
    max_resolution: int = option(
        MAX_RESOLUTION,
        "Largest image that a density makes; what does not fit goes to more images",
        "Layout",
        limits=(4, MAX_RESOLUTION),
        unit="pixels",
        preset=True,
        panel=PanelRow("Largest Page", subtype="PIXEL", only_if=BY_DENSITY),
    )
    mip_levels: int = option(
        0,
        "Down to which mip level the lightmap's charts stay apart: each doubles the padding",
        "Layout",
        limits=(0, 8),
        preset=True,
        panel=PanelRow("Mip Levels"),
    )
    padding: int | None = option(
        None,
        "Free pixels between charts, in place of those that the mip levels need",
        "Layout",
        limits=(1, 512),
        unit="pixels",
        instead_of="mip_levels",
    )
    unwrap_seconds: float = option(
        60.0,
        "Longest time to unwrap one object well; after it the rest is laid out by face direction",
        "Layout",
        limits=(0, UNBOUNDED),
        unit="seconds",
    )
    quality: str = option(
        "medium",
        "How fine the light is computed",
        "Quality",
        choices=QUALITIES,
        preset=True,
        panel=PanelRow(
            "Quality",
            other_choice=Choice(BY_ERROR, "By Error", "As fine as it takes to reach the error below"),
        ),
    )
    relative_error: float | None = option(
        None,
        "How far the light may be off, such as 0.02: RMS, relative to its mean. Texels are lit again, with "
        "more rays, until the estimate is below it",
        "Quality",
        flag="--error",
        limits=(0.002, 0.2),
        instead_of="quality",
        preset=True,
        panel=PanelRow("Error", default=0.02, step=0.1, only_if=(("quality", BY_ERROR),)),
    )
    quantity: str = option(
        "irradiance_over_pi",
        "What a pixel of the lightmap holds",
        "Image",
        choices=QUANTITIES,
        panel=PanelRow("Quantity"),
    )
    light: str = option(
        "all",
        "Which light goes into the lightmap",
        "Image",
        choices=LIGHTS,
        panel=PanelRow("Light"),
    )
    format: str = option(
        "exr",
        "Kind of image file",
        "Image",
        choices=FORMATS,
        panel=PanelRow("Format"),
    )
    objects: tuple[str, ...] | None = option(
        None,
        "What gets a lightmap, instead of every mesh that shows in renders; the rest still lights and blocks",
        "Scene",
        metavar="NAME",
    )
    light_only: tuple[str, ...] = option(
        (),
        "What lights and blocks but gets no lightmap, also if its own mode differs",
        "Scene",
        metavar="NAME",
    )
    ignore: tuple[str, ...] = option(
        (), "What is left out as if it were not there, also if its own mode differs", "Scene", metavar="NAME"
    )
    sky: bool = option(
        False,
        "Add a plain white sky of strength 1 where the scene has no light at all",
        "Scene",
        panel=PanelRow("Sky if Dark"),
    )
    keep_uvs: bool = option(
        False,
        "Use an existing UV layer 'Lightmap' as it is instead of unwrapping",
        "Scene",
        panel=PanelRow("Keep Lightmap UVs"),
    )
    groups: tuple[GroupSetting, ...] = option(
        (),
        "Bake a lightmap also for these lamps, emissive materials or the world; they win over the scene's",
        "Light Groups",
        flag="--light-group",
        metavar="NAME=MEMBER,…",
        repeated=True,
    )
    light_groups: bool = option(
        False,
        "Bake a lightmap for each light group of the scene as well, which the materials mix: colors and "
        "strengths can then be changed without baking",
        "Light Groups",
        panel=PanelRow("Light Groups", identifier="use_light_groups"),
    )
    seed: int = option(
        0,
        "Random seed. Same scene, same seed: the same lightmap to the last bit",
        "Computation",
        limits=(0, 2**31 - 1),  # Blender's renders take no larger one
        panel=PanelRow("Seed"),
    )
    threads: int = option(
        0,
        "Processor threads to use; 0 uses all. The result does not depend on it",
        "Computation",
        limits=(0, 1024),  # as in Blender
        panel=PanelRow("Threads", soft_high=64),
    )
    method: str = option(
        "hierarchical",
        "How the radiosity equation is solved. All come to the same light; Hierarchical is the fastest, the "
        "others are for study and comparison",
        "Solver",
        choices=METHOD_CHOICES,
        preset=True,
        panel=PanelRow("Method"),
    )
    elements: int | None = option(
        None,
        "About how many elements the surfaces are divided into; a triangle is at least one",
        "Solver",
        limits=(1, MOST),
        methods=("two-level", "shooting", *MATRIX),
        preset=True,
        panel=PanelRow("Elements"),
    )
    assembly: str | None = option(
        None,
        "How the matrix is made; conjugate gradients take galerkin only",
        "Solver",
        choices=ASSEMBLIES,
        methods=MATRIX,
        preset=True,
        panel=PanelRow("Assembly"),
    )
    patches: int | None = option(
        None,
        "About how many patches the elements are grouped into",
        "Solver",
        limits=(1, MOST),
        methods=("two-level",),
        preset=True,
        panel=PanelRow("Patches"),
    )
    contrast: float | None = option(
        None,
        "Neighboring elements are split where their light differs by more than this part of the mean",
        "Solver",
        limits=(0, 1000),
        above=True,
        methods=("two-level",),
        preset=True,
        panel=PanelRow("Contrast"),
    )
    form_factor_error: float | None = option(
        None,
        "F_ε: a link is refined while its form factor may exceed this",
        "Solver",
        limits=(0, 1),
        methods=("multi-level",),
        preset=True,
        panel=PanelRow("Form Factor Error", precision=6),
    )
    error: float | None = option(
        None,
        "BF_ε: a link is refined while it may misplace more than this part of the light's power",
        "Solver",
        flag="--link-error",
        limits=(0, 1),
        above=True,
        methods=("hierarchical",),
        preset=True,
        panel=PanelRow("Link Error", precision=6),
    )
    min_area: float | None = option(
        None,
        "A_ε: no element becomes smaller than this part of the scene's lit area",
        "Solver",
        limits=(0, 1),
        above=True,
        methods=LINKS,
        preset=True,
        panel=PanelRow("Smallest Area", precision=6),
    )
    max_links: int | None = option(
        None,
        "Refinement stops at so many links",
        "Solver",
        limits=(1, 1_000_000_000),
        methods=LINKS,
        preset=True,
        panel=PanelRow("Most Links"),
    )
    ambient: bool | None = option(
        None,
        "Show the light that is not sent yet as an even, ambient light; the result does not change",
        "Solver",
        methods=("shooting",),
        preset=True,
        panel=PanelRow("Ambient Term"),
    )
    tolerance: float | None = option(
        None,
        "Residual at which the iteration stops, as a part of the light's power",
        "Solver",
        limits=(0, 1),
        above=True,
        methods=ITERATIVE,
        preset=True,
        panel=PanelRow("Tolerance", precision=6),
    )
    max_iterations: int | None = option(
        None,
        "Iterations, or shots, after which it stops anyway",
        "Solver",
        limits=(1, 1_000_000_000),
        methods=ITERATIVE,
        preset=True,
        panel=PanelRow("Most Iterations"),
    )
    memory_limit: float | None = option(
        None,
        "Memory that the bake may take, in GiB; what would need more is refused",
        "Solver",
        metavar="GIB",
        limits=(0, 1e6),
        above=True,
        unit="GiB",
        methods=ALL,
        panel=PanelRow("Memory Limit"),
    )

    def __post_init__(self) -> None:
        for name, found in OPTIONS.items():
            found.check(getattr(self, name))
        check_combinations(self, OPTIONS)

    def method_settings(self) -> dict[str, Any]:
        """Return the settings of the method that were given, by name."""
        values = {name: getattr(self, name) for name, found in OPTIONS.items() if found.methods}
        return {name: value for name, value in values.items() if value is not None}


OPTIONS = options_of(BakeSettings)
"""Every option of a bake by its field."""


def options_of_method(method: str) -> tuple[str, ...]:
    """Return the names of the options that a method has besides those of all bakes."""
    return tuple(name for name, found in OPTIONS.items() if method in found.methods)
