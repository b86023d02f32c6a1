"""The panel's settings, kept with the scene."""

from __future__ import annotations

import bpy

from ...base import UsageError
from ...options import BakeSettings
from ..scene_records.object_roles import BAKE, BAKEABLE_TYPES
from .option_properties import OptionProperties, chosen_options
from .preferences import DEFAULT_FOLDER, memory_limit_of, threads_of

# Blender 4.5 and later want paths that start with // declared; 4.2 refuses the word.
_RELATIVE_PATH = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()


def _show_lightmap_only(settings: RadiositySettings, _context: bpy.types.Context) -> None:
    from ..material_copies.lightmap_materials import set_lightmap_only

    set_lightmap_only(settings.lightmap_only)


class RadiositySettings(OptionProperties, bpy.types.PropertyGroup):
    """`scene.radiosity`: what the next bake from the panel does; here are those that only the panel has."""

    scope: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Objects",
        description="Which objects get a lightmap; all others still light and block",
        items=[
            ("all", "All", "Every mesh that shows in renders"),
            ("selected", "Selected", "The selected meshes that show in renders"),
            (
                "changed",
                "Changed",
                "Those whose shape, place or reflectance differs from the last bake; others keep their "
                "lightmaps, without new shadows. All, where the light has changed",
            ),
        ],
        default="all",
    )
    size_mode: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Size",
        description="How the size of the lightmaps is chosen",
        items=[
            ("resolution", "Resolution", "Square images of this many pixels"),
            ("density", "Density", "Pixels per metre of surface; the image size follows"),
        ],
        default="resolution",
    )
    output_folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Folder",
        description="Where the lightmaps are written. A folder beside an unsaved file is not known yet: "
        "the lightmaps are then packed into the file",
        default=DEFAULT_FOLDER,
        subtype="DIR_PATH",
        options=_RELATIVE_PATH,
    )
    show_while_solving: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Show While Solving",
        description="Draw the light over the objects in the viewports while a bake runs, as far as it is "
        "known: the elements while it solves, then the texels",
        default=True,
    )
    show_result: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Show Result",
        description="Switch the viewport from solid to material preview when the bake is done",
        default=True,
    )
    lightmap_only: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Lightmap Only",
        description="Show the lightmaps alone instead of base color × lightmap",
        default=False,
        update=_show_lightmap_only,
    )
    baked_light: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Baked Light",
        description="What lamps and settings were at the last bake",
        options={"HIDDEN"},
    )
    baked_objects: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Baked Objects",
        description="The objects of the last bake, and what their shapes were",
        options={"HIDDEN"},
    )
    last_bake: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Last Bake",
        description="Figures and warnings of the last bake",
        options={"HIDDEN"},
    )


def settings_of(context: bpy.types.Context) -> BakeSettings:
    """Return the scene's settings as a bake takes them.

    Raises
    ------
    UsageError
        If a value is out of range, or nothing is selected where the selection is asked for.
    """
    group = context.scene.radiosity
    objects = selected_meshes(context) if group.scope == "selected" else None
    if objects == ():
        raise UsageError("no mesh is selected: select what is to get a lightmap, or switch to All")
    preferred = {"memory_limit": memory_limit_of(context)}
    chosen = {**preferred, **chosen_options(group), "threads": threads_of(context)}
    return BakeSettings(objects=objects, **chosen)


def selected_meshes(context: bpy.types.Context) -> tuple[str, ...]:
    """Return the names of the selected objects that show a surface when rendered and are to be baked."""
    from ..stand_ins.stand_ins import source_name

    return tuple(
        source_name(obj)
        for obj in context.view_layer.objects.selected
        if obj.type in BAKEABLE_TYPES and not obj.hide_render and obj.radiosity_mode == BAKE
    )


def register() -> None:
    """Register the settings and hang them on every scene."""
    bpy.utils.register_class(RadiositySettings)
    bpy.types.Scene.radiosity = bpy.props.PointerProperty(type=RadiositySettings)


def unregister() -> None:
    """Take the settings away; what a file holds stays in the file."""
    del bpy.types.Scene.radiosity
    bpy.utils.unregister_class(RadiositySettings)
