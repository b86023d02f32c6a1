"""The panel's settings, kept with the scene."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ...base import UsageError
from ...options import PANEL_OPTIONS, BakeSettings
from ..scene_records.object_roles import BAKE, BAKEABLE_TYPES
from .option_properties import OptionProperties, chosen_options, option_property
from .preferences import memory_limit_of, threads_of

_putting_back: list[bool] = []
"""Not empty while scenes get back what they said of the look, each its own."""


def _show(settings: RadiositySettings, _context: bpy.types.Context) -> None:
    if not _putting_back:
        show_look_of(settings.id_data)


class RadiositySettings(OptionProperties, bpy.types.PropertyGroup):
    """`scene.radiosity`: the options of the next bake, and a memory of the last one."""

    show: option_property(PANEL_OPTIONS["show"], update=_show)  # type: ignore[valid-type]
    lightmap_only: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Lightmap Only",
        description="What files of earlier versions have for Show",
        options={"HIDDEN"},
    )
    baked_light: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Baked Light",
        description="Lamps and settings of the last bake",
        options={"HIDDEN"},
    )
    baked_objects: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Baked Objects",
        description="Objects of the last bake, and their shapes",
        options={"HIDDEN"},
    )
    last_bake: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Last Bake",
        description="Figures and warnings of the last bake",
        options={"HIDDEN"},
    )


def look_of(scene: bpy.types.Scene) -> str:
    """Return how a scene shows its lightmaps; one without settings stays without."""
    default = PANEL_OPTIONS["show"].default
    return scene.radiosity.show if scene.is_property_set("radiosity") else str(default)


def show_look_of(scene: bpy.types.Scene) -> None:
    """Show all lightmaps of the file as a scene asks; its other scenes say the same from then on."""
    from ..material_copies.lightmap_materials import show_lightmaps

    look = look_of(scene)
    show_lightmaps(look)
    for other in bpy.data.scenes:
        if other.library is None and look_of(other) != look:
            other.radiosity.show = look


@contextmanager
def looks_put_back() -> Iterator[None]:
    """Put back what is shown, and what each scene says of it, if this fails."""
    from ..material_copies.lightmap_materials import looks_kept

    put_back = looks_kept()
    scenes = [scene for scene in bpy.data.scenes if scene.library is None]
    settings = {scene: scene.radiosity for scene in scenes if scene.is_property_set("radiosity")}
    said = {scene: group.show for scene, group in settings.items() if group.is_property_set("show")}
    try:
        yield
    except BaseException:
        put_back()
        _putting_back.append(True)
        for scene in scenes:
            if scene in said:
                scene.radiosity.show = said[scene]
            elif scene in settings:
                scene.radiosity.property_unset("show")
            else:
                scene.property_unset("radiosity")
        _putting_back.pop()
        raise


def read_earlier(_: object = None) -> None:
    """Take over what the open file has from an earlier version."""
    for scene in bpy.data.scenes:
        # Asking for its settings gives a scene some.
        if scene.library is None and scene.is_property_set("radiosity") and scene.radiosity.lightmap_only:
            scene.radiosity.property_unset("lightmap_only")
            scene.radiosity.show = "lightmap"


def settings_of(context: bpy.types.Context) -> BakeSettings:
    """Return the scene's settings as a bake takes them.

    Raises
    ------
    UsageError
        If a value is out of range, or nothing is selected although only the selection is to be baked.
    """
    group = context.scene.radiosity
    objects = selected_meshes(context) if group.scope == "selected" else None
    if objects == ():
        raise UsageError("no mesh is selected: select the objects to bake, or switch to All")
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
