"""Draws the chosen overlay in the 3D viewports, by handlers that are there while the extension is."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import bpy

from ..session import kept_details, lightmap_changes, runtime
from ..session.redraw import redraw_viewports
from .drawing import NEARER, PagedSurfaces, over_the_objects
from .overlay_properties import LINKS, NONE, overlay_of

if TYPE_CHECKING:
    from .overlay_pictures import Lines, OverlayPicture


class _Drawn:
    """What is on the graphics card, and what it was made for."""

    def __init__(self) -> None:
        self.key: tuple[object, ...] | None = None
        self.picture: OverlayPicture | None = None
        self.surfaces: PagedSurfaces | None = None
        self.lines: list[tuple[Lines, Any]] = []

    def clear(self) -> None:
        self.key, self.picture, self.surfaces, self.lines = None, None, None, []


_drawn = _Drawn()
_handlers: list[tuple[Any, str]] = []


def changed() -> None:
    """Make the overlay anew: lightmaps or objects have changed."""
    forget()
    redraw_viewports()


def forget(*_: object) -> None:
    """Forget what was read and made: after an undo or redo anything may be different."""
    # Pixels are only read by a module that is imported when first needed.
    values = sys.modules.get(f"{__package__}.lightmap_values")
    if values is not None:
        values.forget()
    _drawn.clear()


def _draw_over_objects() -> None:
    """Draw surfaces and lines."""
    context = bpy.context
    picture = _current(context)
    if picture is None:
        return
    if _drawn.surfaces is not None:
        with over_the_objects():
            _drawn.surfaces.draw()
    for lines, batch in _drawn.lines:
        _draw_lines(context, lines, batch)


def _draw_legend() -> None:
    """Draw what the colours mean."""
    context = bpy.context
    picture = _current(context)
    if picture is not None and picture.legend is not None:
        from .overlay_legend import draw_legend

        draw_legend(picture.legend, context.preferences.system.ui_scale)


def _current(context: bpy.types.Context) -> OverlayPicture | None:
    """Return the picture to draw, made anew if anything it depends on has changed."""
    settings = overlay_of(context)
    if settings.show == NONE or runtime.running.active:
        return None
    key = _key(context)
    if key != _drawn.key:
        from .overlay_pictures import overlay_picture

        _drawn.clear()
        # The key first: what cannot be made is not tried again at every redraw.
        _drawn.key = key
        _drawn.picture = overlay_picture(context)
        if _drawn.picture is not None:
            _upload(_drawn.picture)
    return _drawn.picture


def _key(context: bpy.types.Context) -> tuple[object, ...]:
    """Return what a picture depends on, but for objects and lightmaps, whose changes are told."""
    settings, scene = overlay_of(context), context.scene
    names = [
        prop.identifier for prop in settings.bl_rna.properties if prop.type not in ("POINTER", "COLLECTION")
    ]
    key: list[object] = [scene.name_full, context.view_layer.name, scene.radiosity.last_bake]
    key += [getattr(settings, name) for name in names]
    if settings.show == LINKS:
        obj = context.active_object
        key += [tuple(scene.cursor.location), None if obj is None else obj.name_full]
        key.append(obj.data.polygons.active if obj is not None and obj.type == "MESH" else None)
    return tuple(key)


def _upload(picture: OverlayPicture) -> None:
    """Hand a picture to the graphics card."""
    import gpu
    import numpy as np
    from gpu_extras.batch import batch_for_shader

    if picture.surfaces is not None:
        surfaces = picture.surfaces
        _drawn.surfaces = PagedSurfaces(surfaces.corners, surfaces.uv, surfaces.page)
        _drawn.surfaces.paint(surfaces.pages)
    shader = gpu.shader.from_builtin("POLYLINE_FLAT_COLOR")
    for lines in picture.lines:
        if len(lines.ends):
            given = {
                "pos": np.ascontiguousarray(lines.ends.reshape(-1, 3), dtype=np.float32),
                "color": np.repeat(lines.colors, 2, axis=0).astype(np.float32),
            }
            _drawn.lines.append((lines, batch_for_shader(shader, "LINES", given)))


def _draw_lines(context: bpy.types.Context, lines: Lines, batch: Any) -> None:
    import gpu

    shader = gpu.shader.from_builtin("POLYLINE_FLAT_COLOR")
    shader.bind()
    shader.uniform_float("viewportSize", (context.region.width, context.region.height))
    shader.uniform_float("lineWidth", lines.width * context.preferences.system.ui_scale)
    with over_the_objects(culled=False, nearer=2.0 * NEARER):
        if lines.through:
            gpu.state.depth_test_set("ALWAYS")
            gpu.state.depth_mask_set(False)
        batch.draw(shader)


def forget_the_file(*_: object) -> None:
    """Another file is being opened: what is kept belongs to this one."""
    kept_details.drop_all()
    forget()


def note_change(_scene: bpy.types.Scene, graph: bpy.types.Depsgraph) -> None:
    """An object has moved, or its mesh or visibility has changed."""
    if _drawn.key is not None and any(
        graph.id_type_updated(kind) for kind in ("OBJECT", "MESH", "COLLECTION")
    ):
        _drawn.clear()


def register() -> None:
    """Begin to draw; without a window there is nothing to draw to."""
    lightmap_changes.listeners.append(changed)
    if bpy.app.background:
        return
    view = bpy.types.SpaceView3D
    for draw, when in ((_draw_over_objects, "POST_VIEW"), (_draw_legend, "POST_PIXEL")):
        _handlers.append((view.draw_handler_add(draw, (), "WINDOW", when), "WINDOW"))


def unregister() -> None:
    """Draw nothing any more, and forget all."""
    while _handlers:
        bpy.types.SpaceView3D.draw_handler_remove(*_handlers.pop())
    if changed in lightmap_changes.listeners:
        lightmap_changes.listeners.remove(changed)
    kept_details.drop_all()
    forget()
