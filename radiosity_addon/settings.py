"""What a bake can be asked to do: one frozen, validated record for all front doors."""

from __future__ import annotations

from dataclasses import dataclass

from .errors import UsageError

QUALITIES = ("draft", "medium", "high")
QUANTITIES = ("irradiance_over_pi", "irradiance", "radiosity")
LIGHTS = ("all", "direct", "indirect")
ATLASES = ("shared", "per-object")
FORMATS = ("exr", "png16")

MAX_RESOLUTION = 16384


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
    quality : "draft", "medium" or "high"
    quantity : what texels hold
        "irradiance_over_pi" H/π [W/m²/sr] as Cycles' diffuse bake without colour,
        "irradiance" H [W/m²], or "radiosity" B = E + ρH [W/m²].
    light : "all", "direct" or "indirect"
    format : "exr" or "png16"
    objects : names of what gets a lightmap, or None for every render-visible mesh
        Everything else still lights and blocks.
    sky : bool
        Add a white sky of strength 1 where the scene has no light at all.
    keep_uvs : bool
        Use an existing UV layer `Lightmap` instead of unwrapping anew.
    seed : int
    threads : int
        0 means all cores. The result does not depend on it.

    Raises
    ------
    UsageError
        If a value is out of its range.
    """

    resolution: int = 512
    texel_density: float | None = None
    atlas: str = "shared"
    quality: str = "medium"
    quantity: str = "irradiance_over_pi"
    light: str = "all"
    format: str = "exr"
    objects: tuple[str, ...] | None = None
    sky: bool = False
    keep_uvs: bool = False
    seed: int = 0
    threads: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.resolution <= MAX_RESOLUTION:
            raise UsageError(f"resolution {self.resolution} is not between 1 and {MAX_RESOLUTION} pixels")
        if self.texel_density is not None and not 0 < self.texel_density < float("inf"):
            raise UsageError(f"texel density {self.texel_density} is not a positive number of pixels a metre")
        if self.threads < 0:
            raise UsageError(f"threads {self.threads} is negative; 0 means all cores")
        if self.seed < 0:
            raise UsageError(f"seed {self.seed} is negative")
        for name, value, allowed in (
            ("atlas", self.atlas, ATLASES),
            ("quality", self.quality, QUALITIES),
            ("quantity", self.quantity, QUANTITIES),
            ("light", self.light, LIGHTS),
            ("format", self.format, FORMATS),
        ):
            if value not in allowed:
                raise UsageError(f"{name} {value!r} is not one of {', '.join(allowed)}")
