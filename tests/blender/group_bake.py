"""Bakes of light groups without a solver: pages made by hand, shown by the real materials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from radiosity_addon.bake.result.result import BakeResult, LightGroup
from radiosity_addon.blender.apply.apply import apply_lightmaps
from radiosity_addon.blender.apply.rebake import originals_shown, replacing_earlier
from radiosity_addon.blender.images.group_images import write_groups
from radiosity_addon.blender.images.images import write_pages
from radiosity_addon.blender.images.light_mixer import mixers, sliders_of
from radiosity_addon.blender.material_copies.lightmap_materials import show_lightmaps
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.hand_bake import add_plane, hand_result, principled_material

LAMP, GLOW = (0.25, 0.5, 2.0), (0.5, 0.0, 1.0)
"""The light of the two groups of `lit_plane`, all over the plane."""

GROUPS = {"Lamps": LAMP, "Glow": GLOW}

EMISSION = 0.5
"""What the plane sends out of its own [W/m²/sr], in each channel."""


def lit_plane() -> bpy.types.Object:
    """A square that glows; what it emits is in the group Glow."""
    emission = {"Emission_Color": (0.25, 0.25, 0.25, 1.0), "Emission_Strength": 2.0}
    plane = add_plane(material=principled_material(**emission))
    plane.radiosity_light_group = "Glow"
    return plane


def page(color: tuple[float, ...]) -> LightmapPage:
    pixels = np.broadcast_to(np.array(color, np.float32), (4, 8, 3)).copy()
    return LightmapPage(pixels, np.ones((4, 8), bool))


def light_groups(colors: Mapping[str, tuple[float, ...]] = GROUPS) -> tuple[LightGroup, ...]:
    return tuple(LightGroup(name, (page(color),)) for name, color in colors.items())


def bake_groups(
    colors: Mapping[str, tuple[float, ...]] = GROUPS,
    folder: Path | None = None,
    failing: Exception | None = None,
    **settings: object,
) -> BakeResult:
    """Export the open scene, pretend to bake these light groups, show the result, and raise `failing`."""
    wanted = BakeSettings(light_groups=True, **settings)
    with originals_shown(bpy.context):
        export = export_scene(bpy.context, wanted)
    whole = tuple(sum(channel) for channel in zip(*colors.values(), strict=True))
    result = replace(hand_result(export, (whole,)), groups=light_groups(colors))
    with replacing_earlier(bpy.context) as earlier:
        images, groups = write_pages(result, wanted, folder), write_groups(result, wanted, folder)
        apply_lightmaps(bpy.context, export, result, images, wanted, groups, earlier)
        show_lightmaps("matte")
        if failing is not None:
            raise failing
    return result


def slide(group: str, strength: float, color: tuple[float, ...] = (1.0, 1.0, 1.0)) -> None:
    """Set the sliders of a group that is shown."""
    (mixer,) = mixers()
    (sliders,) = [each for each in sliders_of(mixer) if each.name == group]
    sliders.strength.default_value = strength
    sliders.color.default_value = (*color, 1.0)
