"""Presets of settings, by Blender's own mechanism: five that come with the add-on, and the user's own."""

from __future__ import annotations

from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from .option_properties import PROPERTIES

FOLDER = "radiosity"
"""Below `presets`, here and among the user's scripts."""

PRESET_PROPERTIES = tuple(option.identifier for option in PROPERTIES if option.preset)
"""What a preset sets, and all it sets: size, quality and method."""


class RADIOSITY_OT_preset_add(AddPresetBase, bpy.types.Operator):
    """Save size, quality and method as a preset, or remove one"""

    bl_idname = "radiosity.preset_add"
    bl_label = "Add Radiosity Preset"

    preset_menu = "RADIOSITY_PT_presets"
    preset_defines = ["settings = bpy.context.scene.radiosity"]
    preset_values = [f"settings.{name}" for name in PRESET_PROPERTIES]
    preset_subdir = FOLDER


class RADIOSITY_PT_presets(PresetPanel, bpy.types.Panel):
    """The presets, in the header of the tab's main panel."""

    bl_idname = "RADIOSITY_PT_presets"
    bl_label = "Radiosity Presets"
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = "radiosity.preset_add"

    @staticmethod
    def reset_cb(context: bpy.types.Context, _filepath: str) -> None:
        """Reset what a preset sets: Blender calls this first, so presets need only name what differs."""
        for name in PRESET_PROPERTIES:
            context.scene.radiosity.property_unset(name)


def register() -> None:
    """Register the folder of our presets with Blender."""
    bpy.utils.register_preset_path(str(Path(__file__).parent))


def unregister() -> None:
    """Have Blender forget it."""
    bpy.utils.unregister_preset_path(str(Path(__file__).parent))


CLASSES = (RADIOSITY_OT_preset_add, RADIOSITY_PT_presets)
