"""What part each object plays in a bake: the user's choice, and Cycles' ray visibility.

*Bake*: lit, blocks, reflects, and gets a lightmap. *Light only*: the same without a lightmap.
*Ignore*: as if it were not there. Ray visibility is taken as Cycles takes it: an object that
diffuse rays do not meet neither reflects nor emits, one that shadow rays do not meet stops no
lamp's light; both still get a lightmap.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import bpy

from ...base import BakeWarning
from ...options import MAX_PAGES, BakeSettings

BAKE, LIGHT_ONLY, IGNORE = "BAKE", "LIGHT_ONLY", "IGNORE"

MODES = (
    (BAKE, "Bake", "It gets a lightmap, and lights and blocks"),
    (LIGHT_ONLY, "Light Only", "It lights and blocks but gets no lightmap"),
    (IGNORE, "Ignore", "It is left out entirely"),
)

BAKEABLE_TYPES = frozenset({"MESH", "CURVE", "SURFACE", "FONT", "META"})
"""All but a mesh are shown as a mesh copy once they are baked."""


def has_role(obj: bpy.types.Object | None) -> bool:
    """Return whether an object can light, block or be baked: surfaces, and instances of collections."""
    return obj is not None and (obj.type in BAKEABLE_TYPES or obj.instance_type == "COLLECTION")


class Role(NamedTuple):
    """What one object, or one instance of it, is there for.

    Parameters
    ----------
    mode : str
        `BAKE`, `LIGHT_ONLY` or `IGNORE`.
    in_bounces, in_shadows : bool
        Whether light of surfaces and sky meets it, and whether it stops light of lamps.
    texel_scale : float
        Texels per meter relative to what others get.
    page : int
        The shared page that it is to be on, from 1; 0 for any.
    warnings : tuple of BakeWarning
    """

    mode: str
    in_bounces: bool
    in_shadows: bool
    texel_scale: float
    page: int = 0
    warnings: tuple[BakeWarning, ...] = ()


def register() -> None:
    """Hang mode, texel scale and page on every object."""
    bpy.types.Object.radiosity_mode = bpy.props.EnumProperty(
        name="Mode", description="Role of the object in a bake", items=MODES, default=BAKE
    )
    bpy.types.Object.radiosity_texel_scale = bpy.props.FloatProperty(
        name="Texel Scale",
        description="Lightmap pixels per meter, relative to the other objects",
        default=1.0,
        min=0.01,
        soft_min=0.1,
        max=100.0,
        soft_max=8.0,
    )
    bpy.types.Object.radiosity_lightmap_page = bpy.props.IntProperty(
        name="Page",
        description="The page of the shared lightmap that the object is on, from 1 to the number of pages; "
        "0 = the emptiest",
        default=0,
        min=0,
        max=MAX_PAGES,
    )


def unregister() -> None:
    """Take them away; what a file holds stays in the file."""
    del bpy.types.Object.radiosity_lightmap_page
    del bpy.types.Object.radiosity_texel_scale
    del bpy.types.Object.radiosity_mode


def role_of(
    shown: bpy.types.Object,
    owner: bpy.types.Object,
    names: Sequence[str],
    settings: BakeSettings,
    held_out: bool = False,
    background: str | None = None,
) -> Role:
    """Return the role of an object.

    Parameters
    ----------
    shown, owner : bpy.types.Object
        Of an instance, the object it shows and the one that makes it; else twice the same.
    names : sequence of str
        What the user may call it.
    settings : BakeSettings
        `ignore` and `light_only` win over the objects' own modes.
    held_out : bool
        A collection it is in is a holdout.
    background : str or None
        The background scene it is of; None for what is of the scene itself.
    """
    both = (shown,) if shown == owner else (shown, owner)
    modes = {getattr(obj, "radiosity_mode", BAKE) for obj in both}
    mode = IGNORE if IGNORE in modes else LIGHT_ONLY if LIGHT_ONLY in modes else BAKE
    if any(name in settings.light_only for name in names):
        mode = LIGHT_ONLY
    if any(name in settings.ignore for name in names):
        mode = IGNORE
    warnings = []
    if mode == BAKE:
        reasons = {
            "a holdout": held_out or any(obj.is_holdout for obj in both),
            "a shadow catcher": any(obj.is_shadow_catcher for obj in both),
        }
        for what, is_so in reasons.items():
            if is_so:
                mode = LIGHT_ONLY
                message = f"object '{shown.name}' is {what}: it lights and blocks but gets no lightmap"
                warnings.append(BakeWarning(shown.name, message))
    if mode == BAKE and background is not None:
        mode = LIGHT_ONLY
        message = f"background scene '{background}': its objects light and block but get no lightmaps"
        warnings.append(BakeWarning(background, f"{message}; open it to bake them"))
    scale = 1.0
    for obj in both:
        scale *= getattr(obj, "radiosity_texel_scale", 1.0)
    return Role(
        mode=mode,
        in_bounces=all(obj.visible_diffuse for obj in both),
        in_shadows=all(obj.visible_shadow for obj in both),
        texel_scale=scale,
        page=next(
            (page for obj in reversed(both) if (page := getattr(obj, "radiosity_lightmap_page", 0))), 0
        ),
        warnings=tuple(warnings),
    )


def half_visible(name: str) -> BakeWarning:
    """Say what is not as in Cycles for an object that only one kind of rays meets."""
    return BakeWarning(
        name,
        f"object '{name}': Ray Visibility has only one of Diffuse and Shadow on; lamps go by Shadow, "
        "light of emissive surfaces and of the world by Diffuse alone, where Cycles mixes both",
    )
