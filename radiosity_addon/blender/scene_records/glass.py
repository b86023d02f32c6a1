"""Whether light goes through the glass of a material: the bake's option, or the material's own choice."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

if TYPE_CHECKING:
    from ...options import BakeSettings

NAME = "radiosity_glass"
"""Our property of materials."""

AS_SET, CLEAR, OPAQUE = "AS_SET", "CLEAR", "OPAQUE"

CHOICES = (
    (AS_SET, "As Set", "As the option Glass Lets Light Through of the bake says"),
    (CLEAR, "Clear", "Light goes straight through this glass, tinted by its color"),
    (OPAQUE, "Opaque", "This glass is baked like an opaque surface"),
)


def lets_light_through(material: bpy.types.Material | None, settings: BakeSettings) -> bool:
    """Tell whether light goes through a material's glass, if it has any."""
    chosen = AS_SET if material is None else getattr(material.original, NAME, AS_SET)
    return bool(settings.light_through_glass if chosen == AS_SET else chosen == CLEAR)


def register() -> None:
    """Hang the choice on every material."""
    bpy.types.Material.radiosity_glass = bpy.props.EnumProperty(
        name="Glass",
        description="Whether light goes through the glass of this material",
        items=CHOICES,
        default=AS_SET,
    )


def unregister() -> None:
    """Take it away; what a file holds stays in the file."""
    del bpy.types.Material.radiosity_glass
