"""The scene's options of relighting, and its memory of the bake that can be relit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import bpy

from ...options import RELIGHT_GROUP, BakeSettings
from ..settings.option_properties import properties_of


class RelightOptions:
    """The options of relighting; mixed into their property group."""

    __annotations__ = properties_of(RELIGHT_GROUP)


class RelightSettings(RelightOptions, bpy.types.PropertyGroup):
    """`scene.radiosity_relight`: the options of relighting, and a memory of the bake that is shown."""

    mark: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Mark", description="The bake that the scene shows", options={"HIDDEN"}
    )
    strengths: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Strengths", description="The light strengths that the lightmaps show", options={"HIDDEN"}
    )


def relight_of(scene: bpy.types.Scene) -> Any:
    """Return the scene's settings to read: Blender would add a group to the file where there is none yet."""
    if scene.is_property_set("radiosity_relight"):
        return scene.radiosity_relight
    properties = [prop for prop in RelightSettings.bl_rna.properties if not prop.is_readonly]
    return SimpleNamespace(**{prop.identifier: getattr(prop, "default", None) for prop in properties})


def keeps(scene: bpy.types.Scene, settings: BakeSettings) -> bool:
    """Return whether a bake of the scene from the panel is to be kept, and can be."""
    from ...bake import can_keep

    chosen = relight_of(scene)
    return bool(chosen.keep or chosen.sidecar) and can_keep(settings)


def register() -> None:
    """Register the settings and hang them on every scene."""
    bpy.utils.register_class(RelightSettings)
    bpy.types.Scene.radiosity_relight = bpy.props.PointerProperty(type=RelightSettings)


def unregister() -> None:
    """Take them away; what a file holds stays in the file."""
    del bpy.types.Scene.radiosity_relight
    bpy.utils.unregister_class(RelightSettings)
