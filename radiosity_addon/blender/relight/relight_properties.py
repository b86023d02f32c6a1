"""What is set for relighting, and remembered of it: with each scene, and of this session alone."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import bpy

from ...options import BakeSettings


class RelightSettings(bpy.types.PropertyGroup):
    """`scene.radiosity_relight`"""

    keep: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Keep for Relighting",
        description="Keep in memory how light gets about, so that other strengths and colors of lamps, "
        "emission and world need no new bake. Takes about 300 bytes for each pixel that shows "
        "a surface, 60 MB at 512 × 512, 1 GB at 2048 × 2048. Bakes of many lamps take somewhat longer",
        default=True,
    )
    sidecar: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Write Sidecar",
        description="Also write it to a file beside the lightmaps, so that this bake can be lit anew after "
        "the scene was closed. About half as large as in memory",
        default=False,
    )
    only_moved: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Only What Moved",
        description="When nothing but places of objects has changed since a bake that is still in memory, "
        "bake anew only what they touch: the same light in less than half of the time. The layout of the "
        "lightmaps stays",
        default=True,
    )
    mark: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Mark", description="Which bake the scene shows", options={"HIDDEN"}
    )
    strengths: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Strengths", description="The strengths its lightmaps were lit by last", options={"HIDDEN"}
    )


def relight_of(scene: bpy.types.Scene) -> Any:
    """Return the scene's settings to read: Blender would add a group to the file where there is none yet."""
    if scene.is_property_set("radiosity_relight"):
        return scene.radiosity_relight
    properties = RelightSettings.bl_rna.properties
    names = ("keep", "sidecar", "only_moved", "mark", "strengths")
    return SimpleNamespace(**{name: properties[name].default for name in names})


def keeps(scene: bpy.types.Scene, settings: BakeSettings) -> bool:
    """Tell whether a bake of the scene from the panel is to be kept, and can be."""
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
