"""The panel's settings, kept with the scene."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ...base import BakeWarning, UsageError
from ...options import PANEL_OPTIONS, BakeSettings
from ..scene_records.object_roles import BAKE, BAKEABLE_TYPES
from .option_properties import OptionProperties, chosen_options, option_property
from .preferences import memory_limit_of, threads_of

_LOOK = ("show", "highlights")
"""What scenes say of the look."""

_quiet: list[bool] = []
"""Not empty while that changes without the look itself."""


def _show(settings: RadiositySettings, _context: bpy.types.Context) -> None:
    if not _quiet:
        show_look_of(settings.id_data)


class RadiositySettings(OptionProperties, bpy.types.PropertyGroup):
    """`scene.radiosity`: the options of the next bake, and a memory of the last one."""

    show: option_property(PANEL_OPTIONS["show"], update=_show)  # type: ignore[valid-type]
    highlights: option_property(PANEL_OPTIONS["highlights"], update=_show)  # type: ignore[valid-type]
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
    baked_lights: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Baked Lights",
        description="Lights of the last bake, and how it read the scene",
        options={"HIDDEN"},
    )
    baked_content: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Baked Content",
        description="Everything in the file when the lightmaps were known to show its light",
        options={"HIDDEN"},
    )
    last_bake: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Last Bake",
        description="Figures and warnings of the last bake",
        options={"HIDDEN"},
    )


def look_of(scene: bpy.types.Scene) -> str:
    """Return how a scene shows its lightmaps; one without settings stays without."""
    return str(_said_by(scene, "show"))


def show_look_of(scene: bpy.types.Scene) -> tuple[BakeWarning, ...]:
    """Show all lightmaps of the file as a scene asks; its other scenes say the same from then on.

    Returns warnings: Of what is linked and keeps another look, and of lamps whose highlights stay.
    """
    from ..apply.lamp_highlights import show_highlights
    from ..material_copies.lightmap_materials import linked_looks, show_lightmaps

    show_lightmaps(look_of(scene))
    highlights = show_highlights(bool(_said_by(scene, "highlights")))
    with _quietly():
        for other in bpy.data.scenes:
            for name in _LOOK if other.library is None else ():
                if _said_by(other, name) != _said_by(scene, name):
                    setattr(other.radiosity, name, _said_by(scene, name))
    return (*linked_looks(look_of(scene)), *highlights)


def unite_looks(_: object = None) -> None:
    """Have what was appended be shown as the open scene shows its own."""
    from ..apply.lamp_highlights import show_highlights
    from ..images.node_group import is_shown_by_all

    scene = bpy.context.scene
    if scene is None:
        return
    scenes = [other for other in bpy.data.scenes if other.library is None]
    said_alike = all(_said_by(other, name) == _said_by(scene, name) for other in scenes for name in _LOOK)
    if not said_alike or not is_shown_by_all(look_of(scene)):
        show_look_of(scene)
    elif _said_by(scene, "highlights"):
        show_highlights(True)


def _said_by(scene: bpy.types.Scene, name: str) -> object:
    """Return what a scene says of the look."""
    default = PANEL_OPTIONS[name].default
    return getattr(scene.radiosity, name) if scene.is_property_set("radiosity") else default


@contextmanager
def looks_put_back() -> Iterator[None]:
    """Put back what is shown, and what each scene says of it, if this fails."""
    from ..apply.lamp_highlights import highlights_kept
    from ..material_copies.lightmap_materials import looks_kept

    shown, highlights = looks_kept(), highlights_kept()
    scenes = [scene for scene in bpy.data.scenes if scene.library is None]
    settings = {scene: scene.radiosity for scene in scenes if scene.is_property_set("radiosity")}
    said = {
        (scene, name): getattr(group, name)
        for scene, group in settings.items()
        for name in _LOOK
        if group.is_property_set(name)
    }
    try:
        yield
    except BaseException:
        shown()
        highlights()
        with _quietly():
            for scene in scenes:
                for name in _LOOK if scene in settings else ():
                    scene.radiosity.property_unset(name)
                if scene not in settings:
                    scene.property_unset("radiosity")
            for (scene, name), value in said.items():
                setattr(scene.radiosity, name, value)
        raise


@contextmanager
def _quietly() -> Iterator[None]:
    """Change what scenes say of the look, and not the look."""
    _quiet.append(True)
    try:
        yield
    finally:
        _quiet.pop()


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
