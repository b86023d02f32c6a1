"""What a bake can be asked to do: one frozen, validated record for all front doors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..base import UsageError
from .methods import SETTINGS, check_method

QUALITIES = ("draft", "medium", "high")
QUANTITIES = ("irradiance_over_pi", "irradiance", "radiosity", "residual")
LIGHTS = ("all", "direct", "indirect")
ATLASES = ("shared", "per-object")
FORMATS = ("exr", "png16")

MAX_RESOLUTION = 16384
MAX_PAGES = 64
MAX_MIP_LEVELS = 8
MAX_PADDING = 512
EFFICACY = 683.0
"""Lumens a watt of green light of 555 nm; taken for all light where nothing else is said [lm/W]."""

MIN_ERROR, MAX_ERROR = 0.002, 0.2
MAX_SEED = 2**31 - 1
"""Blender's renders take no larger one."""

MAX_THREADS = 1024
"""As in Blender."""

MAX_GROUPS = 24
"""Light groups of a bake: each is an image that its materials read, and graphics cards take 32, some 16."""

GroupSetting = tuple[str, tuple[str, ...]]
"""A light group: its name, and the names of its lamps, emissive materials and the world."""

OTHERS = "others"
"""The light group of what is in none."""


@dataclass(frozen=True)
class BakeSettings:
    """One bake's settings, as the command line and the panel both give them.

    Parameters
    ----------
    resolution : int
        Width and height of an atlas page in texels, 1 to 16384.
    texel_density : float or None
        Texels per metre; the page size then follows from the surface area.
        Exclusive with an explicit resolution (the front doors see to that).
    atlas : "shared" or "per-object"
    pages : int
        How many pages of that resolution the objects of a shared atlas are shared out over;
        with a density there are as many as it takes.
    max_resolution : int
        Width and height that a page may have at most where a density sets its size.
    mip_levels : int
        Down to which mip level charts stay apart, 0 to 8.
    padding : int or None
        Free texels between charts; None takes what the mip levels ask for.
    unwrap_seconds : float
        How long one object may be unwrapped before the rest of it is cut more simply.
    quality : "draft", "medium" or "high"
    relative_error : float or None
        The RMS error to reach, relative to the mean of the light, 0.002 to 0.2; replaces the
        quality.
    quantity : what texels hold
        "irradiance_over_pi" H/π [W/m²/sr] as Cycles' diffuse bake without colour,
        "irradiance" H [W/m²], "radiosity" B = E + ρH [W/m²], or "residual" r [W/m²], the error
        picture: by how much the elements miss the radiosity equation, signed.
    light : "all", "direct" or "indirect"
    format : "exr" or "png16"
    objects : names of what gets a lightmap, or None for every render-visible mesh
        Everything else still lights and blocks.
    light_only, ignore : tuple of str
        Names of objects that get no lightmap, and of objects left out as if they were not
        there; they win over the objects' own modes.
    sky : bool
        Add a white sky of strength 1 where the scene has no light at all.
    keep_uvs : bool
        Use an existing UV layer `Lightmap` instead of unwrapping anew.
    groups : tuple of (str, tuple of str)
        Light groups: each one's name, and the names of the lamps, emissive materials and world in it.
        Each gets lightmaps of its own; so does what is in none of them.
    light_groups : bool
        Also bake the light groups that the scene itself has; `groups` win where both say something.
    seed : int
        0 to 2³¹ − 1.
    threads : int
        0 to 1024; 0 means all cores. The result does not depend on it.
    method : str
        How the radiosity equation is solved: a name of `methods.METHODS`.
    elements, assembly, patches, contrast, form_factor_error, error, min_area, max_links, \
    ambient, tolerance, max_iterations, memory_limit : optional
        Settings of the method, see `SolverSettings`; None takes what the quality says.

    Raises
    ------
    UsageError
        If a value is out of its range, or a setting does not apply to the method.
    """

    resolution: int = 512
    texel_density: float | None = None
    atlas: str = "shared"
    pages: int = 1
    max_resolution: int = MAX_RESOLUTION
    mip_levels: int = 0
    padding: int | None = None
    unwrap_seconds: float = 60.0
    quality: str = "medium"
    relative_error: float | None = None
    quantity: str = "irradiance_over_pi"
    light: str = "all"
    format: str = "exr"
    objects: tuple[str, ...] | None = None
    light_only: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    sky: bool = False
    keep_uvs: bool = False
    groups: tuple[GroupSetting, ...] = ()
    light_groups: bool = False
    seed: int = 0
    threads: int = 0
    method: str = "hierarchical"
    elements: int | None = None
    assembly: str | None = None
    patches: int | None = None
    contrast: float | None = None
    form_factor_error: float | None = None
    error: float | None = None
    min_area: float | None = None
    max_links: int | None = None
    ambient: bool | None = None
    tolerance: float | None = None
    max_iterations: int | None = None
    memory_limit: float | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.resolution <= MAX_RESOLUTION:
            raise UsageError(f"resolution {self.resolution} is not between 1 and {MAX_RESOLUTION} pixels")
        if self.texel_density is not None and not 0 < self.texel_density < float("inf"):
            raise UsageError(f"texel density {self.texel_density} is not a positive number of pixels a metre")
        self._check_atlas()
        if self.relative_error is not None and not MIN_ERROR <= self.relative_error <= MAX_ERROR:
            raise UsageError(f"error {self.relative_error} is not between {MIN_ERROR} and {MAX_ERROR}")
        if self.relative_error is not None and self.quantity == "residual":
            raise UsageError("a residual is an error picture: leave --error out, or bake another quantity")
        if not 0 <= self.threads <= MAX_THREADS:
            raise UsageError(f"threads {self.threads} is not between 0 and {MAX_THREADS}; 0 means all cores")
        for name in (*self.light_only, *self.ignore):
            if name in (self.objects or ()):
                raise UsageError(f"object '{name}' cannot both get a lightmap and be light only or ignored")
        if not 0 <= self.seed <= MAX_SEED:
            raise UsageError(f"seed {self.seed} is not between 0 and {MAX_SEED}")
        for name, value, allowed in (
            ("atlas", self.atlas, ATLASES),
            ("quality", self.quality, QUALITIES),
            ("quantity", self.quantity, QUANTITIES),
            ("light", self.light, LIGHTS),
            ("format", self.format, FORMATS),
        ):
            if value not in allowed:
                raise UsageError(f"{name} {value!r} is not one of {', '.join(allowed)}")
        if self.quantity == "residual":
            self._check_residual()
        self._check_groups()
        check_method(self.method, self.method_settings())

    def _check_atlas(self) -> None:
        """Refuse what pages cannot be."""
        if not 1 <= self.pages <= MAX_PAGES:
            raise UsageError(f"{self.pages} pages are not between 1 and {MAX_PAGES}")
        if self.pages > 1 and (self.atlas != "shared" or self.texel_density is not None):
            raise UsageError("pages are for a shared atlas of a given resolution; else they are counted")
        if not 4 <= self.max_resolution <= MAX_RESOLUTION:
            raise UsageError(
                f"largest page {self.max_resolution} is not between 4 and {MAX_RESOLUTION} pixels"
            )
        if not 0 <= self.mip_levels <= MAX_MIP_LEVELS:
            raise UsageError(f"mip level {self.mip_levels} is not between 0 and {MAX_MIP_LEVELS}")
        if self.padding is not None and not 1 <= self.padding <= MAX_PADDING:
            raise UsageError(f"padding {self.padding} is not between 1 and {MAX_PADDING} pixels")
        if not self.unwrap_seconds >= 0:
            raise UsageError(f"unwrapping for {self.unwrap_seconds} seconds is not possible")

    def _check_residual(self) -> None:
        """Refuse what an error picture cannot be."""
        if self.format != "exr":
            raise UsageError(
                f"a residual has negative values, which format {self.format} cannot hold: take format exr"
            )
        if self.light != "all":
            raise UsageError(
                f"a residual is of the whole solution, not of its {self.light} light: take light all"
            )

    def _check_groups(self) -> None:
        """Refuse what light groups cannot be."""
        names = [name for name, _ in self.groups]
        if "" in names:
            raise UsageError("a light group has no name")
        inside = [member for _, group in self.groups for member in group]
        for kind, found in (("light group", names), ("member of light groups", inside)):
            twice = next((name for name in found if found.count(name) > 1), None)
            if twice is not None:
                raise UsageError(f"{kind} '{twice}' is there twice")
        wanted = bool(self.groups) or self.light_groups
        if wanted and self.method != "hierarchical":
            raise UsageError(f"light groups need the hierarchical method; {self.method} keeps no links")
        if wanted and self.quantity == "residual":
            raise UsageError("a residual is of all light together: bake another quantity for light groups")

    def method_settings(self) -> dict[str, Any]:
        """Return the settings of the method that were given, by name."""
        values = {name: getattr(self, name) for name in SETTINGS}
        return {name: value for name, value in values.items() if value is not None}
