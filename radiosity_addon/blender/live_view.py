"""The solution in the viewports while it is being solved: the method's elements, drawn over the objects.

Nothing of it is in the file: the elements are drawn by a handler of Blender's 3D viewports that
is there between `begin` and `end`. Without a window there is nothing to draw to, and all of
this does nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import bpy
from bpy.app.handlers import persistent

if TYPE_CHECKING:
    from ..bake_scene import Picture

NEARER = 2e-5
"""How much nearer than its object an element is drawn, as a share of half the range of depths."""

WHITE = 16.0
"""Radiance that view transforms with soft highlights (AgX, Filmic) show white, at exposure 0 [W/m²/sr]."""

_HARD = frozenset({"Standard", "Raw", "False Color"})
"""View transforms that show radiance 1 as white."""


class _LiveView:
    """The newest picture and the handler that draws it."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        # By name: undo would make a reference stale.
        self._scene = scene.name_full
        self._exposure = 2.0**scene.view_settings.exposure
        self._white = 1.0 if scene.view_settings.view_transform in _HARD else WHITE
        self._picture: Picture | None = None
        self._batches: dict[float, list[tuple[bool, Any]]] = {}
        self._shader: Any = None
        self._handler = bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_VIEW")

    def show(self, picture: Picture) -> None:
        """Draw this from now on."""
        self._picture, self._batches = picture, {}

    def close(self) -> None:
        """Draw nothing any more."""
        bpy.types.SpaceView3D.draw_handler_remove(self._handler, "WINDOW")
        self._picture, self._batches, self._shader = None, {}, None

    def _draw(self) -> None:
        """Draw the elements into the viewport whose turn it is."""
        if self._picture is None or bpy.context.scene.name_full != self._scene:
            return
        shading = bpy.context.space_data.shading
        exposure = self._exposure if _uses_exposure(shading) else 1.0
        if exposure not in self._batches:
            self._batches[exposure] = self._upload(self._picture, exposure)
        with _over_the_objects():
            for front, batch in self._batches[exposure]:
                if front or not shading.show_backface_culling:
                    batch.draw(self._shader)

    def _upload(self, picture: Picture, exposure: float) -> list[tuple[bool, Any]]:
        """Hand the picture to the graphics card, fronts and backs apart: once, however often it is drawn."""
        import gpu
        from gpu_extras.batch import batch_for_shader

        from .live_picture import corner_arrays

        if self._shader is None:
            self._shader = gpu.shader.from_builtin("FLAT_COLOR")
        batches = []
        for front in (True, False):
            side = picture.only(picture.front == front)
            if len(side):
                positions, colors = corner_arrays(side, exposure, self._white)
                corners = {"pos": positions, "color": colors}
                batches.append((front, batch_for_shader(self._shader, "TRIS", corners)))
        return batches


def _uses_exposure(shading: bpy.types.View3DShading) -> bool:
    """Tell whether a viewport will show the lightmaps with the scene's exposure.

    As Blender does: not in a material preview that is lit by a studio light alone. One that is
    solid now is taken for the material preview it can be switched to.
    """
    if shading.type == "RENDERED":
        return shading.use_scene_lights_render or shading.use_scene_world_render
    return shading.use_scene_lights or shading.use_scene_world


@contextmanager
def _over_the_objects() -> Iterator[None]:
    """Draw what lies where the objects lie, in front of them."""
    import gpu
    from mathutils import Matrix

    depth_test, depth_mask = gpu.state.depth_test_get(), gpu.state.depth_mask_get()
    nearer = Matrix.Translation((0.0, 0.0, -NEARER)) @ gpu.matrix.get_projection_matrix()
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    # The two sides of a triangle lie in one place, each counter-clockwise as seen from its own.
    gpu.state.face_culling_set("BACK")
    try:
        with gpu.matrix.push_pop_projection():
            gpu.matrix.load_projection_matrix(nearer)
            yield
    finally:
        gpu.state.face_culling_set("NONE")
        gpu.state.depth_mask_set(depth_mask)
        gpu.state.depth_test_set(depth_test)


_view: _LiveView | None = None


def begin(scene: bpy.types.Scene) -> None:
    """Have the pictures that come drawn in all 3D viewports, about as bright as the lightmaps will be."""
    global _view
    end()
    if bpy.app.background:
        return
    _view = _LiveView(scene)
    bpy.app.handlers.load_pre.append(_end_with_the_file)


def show(picture: Picture) -> None:
    """Draw a picture in place of the one before, unless nothing shines in it yet."""
    if _view is not None and picture.radiosity.any():
        _view.show(picture)
        _redraw()


def end() -> None:
    """Leave the viewports as they were; harmless where nothing was begun."""
    global _view
    view, _view = _view, None
    if view is not None:
        bpy.app.handlers.load_pre.remove(_end_with_the_file)
        view.close()
        _redraw()


def is_active() -> bool:
    """Tell whether pictures are being drawn."""
    return _view is not None


def _redraw() -> None:
    """Have every 3D viewport drawn again."""
    manager = bpy.context.window_manager
    for window in manager.windows if manager is not None else ():
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "WINDOW":
                        region.tag_redraw()


@persistent
def _end_with_the_file(*_: object) -> None:
    """Another file is being opened: what was drawn belongs to this one."""
    end()
