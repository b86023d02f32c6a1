"""The table of a bake's options, and one bake's settings by it: validated, for all front doors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .choices import ASSEMBLIES, ATLASES, FORMATS, LIGHTS, METHOD_CHOICES, PACKS, QUALITIES, QUANTITIES
from .combinations import check_combinations
from .constants import MAX_PAGES, MAX_RESOLUTION
from .methods import ALL, ITERATIVE, LINKS, MATRIX
from .option_record import UNBOUNDED, Choice, PanelRow, option, options_of

MAX_ELEMENTS = 10_000_000
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
        "Lightmap pixels per meter of surface; the size of the lightmap follows",
        "Size",
        metavar="PX_PER_M",
        limits=(0, 1e9),
        above=True,
        unit="pixels per meter",
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
        "Number of images for the objects of a shared atlas; set automatically with a density",
        "Pages",
        limits=(1, MAX_PAGES),
        panel=PanelRow("Pages", soft_high=16, only_if=(("atlas", "shared"), *AS_A_WHOLE)),
    )
    pack: str = option(
        "charts",
        "How charts are packed into shared images",
        "Layout",
        choices=PACKS,
        preset=True,
        panel=PanelRow("Pack", only_if=(("atlas", "shared"),)),
    )
    max_resolution: int = option(
        MAX_RESOLUTION,
        "Largest image that a density makes; objects that do not fit go to more images",
        "Layout",
        limits=(4, MAX_RESOLUTION),
        unit="pixels",
        preset=True,
        panel=PanelRow("Max Page Size", subtype="PIXEL", only_if=BY_DENSITY),
    )
    mip_levels: int = option(
        0,
        "Coarsest mip level at which the lightmap's charts stay apart; each level doubles the padding",
        "Layout",
        limits=(0, 8),
        preset=True,
        panel=PanelRow("Mip Levels"),
    )
    padding: int | None = option(
        None,
        "Free pixels between charts, instead of those that the mip levels need",
        "Layout",
        limits=(1, 512),
        unit="pixels",
        instead_of="mip_levels",
    )
    unwrap_seconds: float = option(
        60.0,
        "Max time to unwrap one object well; the rest of it is then laid out by face direction",
        "Layout",
        limits=(0, UNBOUNDED),
        unit="seconds",
    )
    quality: str = option(
        "medium",
        "Accuracy of the light, and so the time that the bake takes",
        "Quality",
        choices=QUALITIES,
        preset=True,
        panel=PanelRow(
            "Quality",
            other_choice=Choice(BY_ERROR, "By Error", "As accurate as needed to reach the error below"),
        ),
    )
    relative_error: float | None = option(
        None,
        "Target error of the light, such as 0.02: RMS, relative to the mean. Rays are added until the "
        "estimate is below it",
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
        "File format of the images",
        "Image",
        choices=FORMATS,
        panel=PanelRow("Format"),
    )
    objects: tuple[str, ...] | None = option(
        None,
        "Objects that get a lightmap, instead of every mesh that shows in renders; all others still light "
        "and block",
        "Scene",
        metavar="NAME",
    )
    light_only: tuple[str, ...] = option(
        (),
        "Objects that light and block but get no lightmap, whatever their own mode is",
        "Scene",
        metavar="NAME",
    )
    ignore: tuple[str, ...] = option(
        (), "Objects that are left out entirely, whatever their own mode is", "Scene", metavar="NAME"
    )
    sky: bool = option(
        False,
        "Add a white sky of strength 1 if the scene has no light",
        "Scene",
        panel=PanelRow("Sky if No Light"),
    )
    keep_uvs: bool = option(
        False,
        "Use an existing UV layer 'Lightmap' as it is instead of unwrapping",
        "Scene",
        panel=PanelRow("Keep Lightmap UVs"),
    )
    groups: tuple[GroupSetting, ...] = option(
        (),
        "Also bake a lightmap of these lamps, emissive materials or the world; overrides the scene's groups",
        "Light Groups",
        flag="--light-group",
        metavar="NAME=MEMBER,…",
        repeated=True,
    )
    light_groups: bool = option(
        False,
        "Also bake a lightmap for each light group of the scene. Materials mix them, so colors and "
        "strengths can be changed without baking",
        "Light Groups",
        panel=PanelRow("Light Groups", identifier="use_light_groups"),
    )
    seed: int = option(
        0,
        "Random seed. The same scene and seed give the same lightmap to the last bit",
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
        "Method of solving the radiosity equation. All methods give the same light; Hierarchical is the "
        "fastest, the others are for study and comparison",
        "Solver",
        choices=METHOD_CHOICES,
        preset=True,
        panel=PanelRow("Method"),
    )
    elements: int | None = option(
        None,
        "Approximate number of elements that surfaces are divided into; at least one per triangle",
        "Solver",
        limits=(1, MAX_ELEMENTS),
        methods=("two-level", "shooting", *MATRIX),
        preset=True,
        panel=PanelRow("Elements"),
    )
    assembly: str | None = option(
        None,
        "How the matrix is assembled; conjugate gradients need Galerkin",
        "Solver",
        choices=ASSEMBLIES,
        methods=MATRIX,
        preset=True,
        panel=PanelRow("Assembly"),
    )
    patches: int | None = option(
        None,
        "Approximate number of patches that elements are grouped into",
        "Solver",
        limits=(1, MAX_ELEMENTS),
        methods=("two-level",),
        preset=True,
        panel=PanelRow("Patches"),
    )
    contrast: float | None = option(
        None,
        "Neighboring elements are split where their light differs by more than this fraction of the mean",
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
        "BF_ε: a link is refined while it may misplace more than this fraction of the light's power",
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
        "A_ε: no element becomes smaller than this fraction of the scene's lit area",
        "Solver",
        limits=(0, 1),
        above=True,
        methods=LINKS,
        preset=True,
        panel=PanelRow("Min Area", precision=6),
    )
    max_links: int | None = option(
        None,
        "Refinement stops at this number of links",
        "Solver",
        limits=(1, 1_000_000_000),
        methods=LINKS,
        preset=True,
        panel=PanelRow("Max Links"),
    )
    ambient: bool | None = option(
        None,
        "Show light that was not sent yet as uniform ambient light; the result does not change",
        "Solver",
        methods=("shooting",),
        preset=True,
        panel=PanelRow("Ambient Term"),
    )
    tolerance: float | None = option(
        None,
        "Residual at which the iteration stops, as a fraction of the light's power",
        "Solver",
        limits=(0, 1),
        above=True,
        methods=ITERATIVE,
        preset=True,
        panel=PanelRow("Tolerance", precision=6),
    )
    max_iterations: int | None = option(
        None,
        "Max number of iterations, or shots",
        "Solver",
        limits=(1, 1_000_000_000),
        methods=ITERATIVE,
        preset=True,
        panel=PanelRow("Max Iterations"),
    )
    memory_limit: float | None = option(
        None,
        "Memory that the bake may take, in GiB; bakes that need more are refused",
        "Solver",
        metavar="GIB",
        limits=(0, 1e6),
        above=True,
        unit="GiB",
        methods=ALL,
        panel=PanelRow("Memory Limit"),
    )
    light_through_glass: bool = option(
        True,
        "Light goes straight through glass, tinted by its color; else glass is baked like an opaque surface",
        "Scene",
        flag="--opaque-glass",
        off="Bake glass like an opaque surface; else light goes straight through it, tinted by its color",
        panel=PanelRow("Glass Lets Light Through"),
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
