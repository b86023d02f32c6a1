"""The add-on's preferences: what scenes that say nothing else are baked with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ...options import OPTIONS, PANEL_OPTIONS
from .option_properties import option_property

DEFAULT_FOLDER: str = PANEL_OPTIONS["output_folder"].default

PACKAGE = __package__.removesuffix(".blender.settings")
"""The add-on's own module: `bl_ext.<repository>.radiosity_addon` where it is installed."""


class RADIOSITY_AP_preferences(bpy.types.AddonPreferences):
    """Defaults for scenes that have not set them."""

    bl_idname = PACKAGE

    output_folder: option_property(  # type: ignore[valid-type]
        PANEL_OPTIONS["output_folder"],
        description="Where lightmaps are written, for scenes that set no folder. One that begins with // "
        "is next to the file",
    )
    memory_limit: option_property(  # type: ignore[valid-type]
        OPTIONS["memory_limit"],
        description="Memory that a bake may take in GiB, for scenes that set none. 0 = 4 GiB",
    )
    threads: option_property(  # type: ignore[valid-type]
        OPTIONS["threads"],
        description="Processor threads, for scenes that set no number; 0 uses all. The result is the same",
    )
    check_first: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Check First",
        description="Before a scene is baked for the first time, show its problems, if there are any",
        default=True,
    )

    farm_command: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Farm Command",
        description="Command that is run once for each bake to start workers that help with it, without a "
        "shell. {spool} in it stands for the bake's folder. Empty: bakes are not shared",
    )
    spool_folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Spool Folder",
        description="Folder that all machines with workers share: each bake makes one of its own in it, and "
        "removes that at its end. Empty: bakes are not shared",
        subtype="DIR_PATH",
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw them."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column(heading="Defaults")
        column.prop(self, "output_folder")
        column.prop(self, "memory_limit")
        column.prop(self, "threads")
        layout.column(heading="First Bake").prop(self, "check_first")
        column = layout.column(heading="Several Machines")
        column.prop(self, "farm_command")
        column.prop(self, "spool_folder")


class Defaults:
    """The preferences of a Blender in which the add-on is only registered, not installed."""

    output_folder = DEFAULT_FOLDER
    memory_limit = 0.0
    threads = 0
    check_first = True
    farm_command = ""
    spool_folder = ""


def preferences(context: bpy.types.Context) -> Any:
    """Return the add-on's preferences."""
    entry = context.preferences.addons.get(PACKAGE)
    found = None if entry is None else entry.preferences
    return Defaults if found is None else found


def folder_of(context: bpy.types.Context) -> str:
    """Return where a scene's lightmaps go: its own folder, or the preferences'."""
    scene, chosen = context.scene, ""
    # Merely reading the settings would leave them in a file that has none.
    if scene.is_property_set("radiosity") and scene.radiosity.is_property_set("output_folder"):
        chosen = scene.radiosity.output_folder
    return chosen.strip() or preferences(context).output_folder.strip() or DEFAULT_FOLDER


def threads_of(context: bpy.types.Context) -> int:
    """Return the threads a scene is baked with."""
    group = context.scene.radiosity
    return group.threads if group.is_property_set("threads") else preferences(context).threads


def memory_limit_of(context: bpy.types.Context) -> float | None:
    """Return the memory limit [GiB] of a scene that sets none; None for the usual one."""
    return preferences(context).memory_limit or None


CLASSES = (RADIOSITY_AP_preferences,)


def is_packed(context: bpy.types.Context) -> bool:
    """Whether the panel's bake packs its lightmaps: a folder next to an unsaved file has no place yet."""
    return folder_of(context).startswith("//") and not bpy.data.filepath


def output_folder(context: bpy.types.Context) -> Path | None:
    """Return where the panel's bake writes; None if it packs."""
    return None if is_packed(context) else Path(bpy.path.abspath(folder_of(context))).resolve()
