"""Draws the chosen overlay in the 3D viewports, by handlers that are there while the extension is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import gpu

from ..session.redraw import redraw_viewports
from ..session.state import session
from .drawing import NEARER, PagedSurfaces, over_the_objects
from .overlay_properties import LINKS, NONE, overlay_of

if TYPE_CHECKING:
    from .overlay_pictures import Lines, OverlayPicture


_handlers: list[tuple[Any, str]] = []


def changed() -> None:
    """Redraw the overlay: lightmaps or objects have changed."""
    forget()
    redraw_viewports()


def forget(*_: object) -> None:
    """Forget what was read and made: after an undo or redo anything may be different."""
    session.drawn.forget()


def _draw_over_objects() -> None:
    """Draw surfaces and lines."""
    context = bpy.context
    picture = _current(context)
    if picture is None:
        return
    if session.drawn.surfaces is not None:
        with over_the_objects():
            session.drawn.surfaces.draw()
    for lines, batch in session.drawn.lines:
        _draw_lines(context, lines, batch)


def _draw_legend() -> None:
    """Draw what the colors mean."""
    context = bpy.context
    picture = _current(context)
    if picture is not None and picture.legend is not None:
        from .overlay_legend import draw_legend

        draw_legend(picture.legend, context.preferences.system.ui_scale)


def _current(context: bpy.types.Context) -> OverlayPicture | None:
    """Return the picture to draw, made again if anything it depends on has changed."""
    settings = overlay_of(context)
    if settings.show == NONE or session.running.active:
        return None
    key = _key(context)
    if key != session.drawn.key:
        from .overlay_pictures import overlay_picture

        session.drawn.clear()
        # The key first: what cannot be made is not tried again at every redraw.
        session.drawn.key = key
        session.drawn.picture = overlay_picture(context)
        if session.drawn.picture is not None:
            _upload(session.drawn.picture)
    return session.drawn.picture


def _key(context: bpy.types.Context) -> tuple[object, ...]:
    """Return what a picture depends on, except for objects and lightmaps, whose changes are reported."""
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
    import numpy as np
    from gpu_extras.batch import batch_for_shader

    if picture.surfaces is not None:
        surfaces = picture.surfaces
        session.drawn.surfaces = PagedSurfaces(surfaces.corners, surfaces.uv, surfaces.page)
        session.drawn.surfaces.paint(surfaces.pages)
    shader = gpu.shader.from_builtin("POLYLINE_FLAT_COLOR")
    for lines in picture.lines:
        if len(lines.ends):
            given = {
                "pos": np.ascontiguousarray(lines.ends.reshape(-1, 3), dtype=np.float32),
                "color": np.repeat(lines.colors, 2, axis=0).astype(np.float32),
            }
            session.drawn.lines.append((lines, batch_for_shader(shader, "LINES", given)))


def _draw_lines(context: bpy.types.Context, lines: Lines, batch: Any) -> None:
    shader = gpu.shader.from_builtin("POLYLINE_FLAT_COLOR")
    shader.bind()
    shader.uniform_float("viewportSize", (context.region.width, context.region.height))
    shader.uniform_float("lineWidth", lines.width * context.preferences.system.ui_scale)
    with over_the_objects(culled=False, nearer=2.0 * NEARER):
        if lines.through:
            gpu.state.depth_test_set("ALWAYS")
            gpu.state.depth_mask_set(False)
        batch.draw(shader)


def note_change(_scene: bpy.types.Scene, graph: bpy.types.Depsgraph) -> None:
    """An object has moved, or its mesh or visibility has changed."""
    if session.drawn.key is not None and any(
        graph.id_type_updated(kind) for kind in ("OBJECT", "MESH", "COLLECTION")
    ):
        session.drawn.clear()


def register() -> None:
    """Begin to draw; without a window there is nothing to draw to."""
    session.on_lightmaps_changed.append(changed)
    if bpy.app.background:
        return
    view = bpy.types.SpaceView3D
    for draw, when in ((_draw_over_objects, "POST_VIEW"), (_draw_legend, "POST_PIXEL")):
        _handlers.append((view.draw_handler_add(draw, (), "WINDOW", when), "WINDOW"))


def unregister() -> None:
    """Draw nothing any more, and forget all."""
    while _handlers:
        bpy.types.SpaceView3D.draw_handler_remove(*_handlers.pop())
    if changed in session.on_lightmaps_changed:
        session.on_lightmaps_changed.remove(changed)
