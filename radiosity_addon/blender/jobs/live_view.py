"""The light in the viewports while it is being computed, drawn over the objects.

First the method's elements, while it solves; then the texels of the lightmaps, as they are lit.

Nothing of it is in the file: all is drawn by a handler of Blender's 3D viewports that
is there between `begin` and `end`. Without a window there is nothing to draw to, and all of
this does nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import gpu
from bpy.app.handlers import persistent

from ..overlays.drawing import PagedSurfaces, over_the_objects
from ..session.redraw import redraw_viewports as _redraw

if TYPE_CHECKING:
    from ...bake.result import Picture, TexelPicture, TexelSurfaces

WHITE_RADIANCE = 16.0
"""Radiance that view transforms with soft highlights (AgX, Filmic) show white, at exposure 0 [W/m²/sr]."""

_HARD = frozenset({"Standard", "Raw", "False Color"})
"""View transforms that show radiance 1 as white."""


class _LiveView:
    """The newest picture and the handler that draws it."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        # By name: undo would make a reference stale.
        self._scene = scene.name_full
        self._exposure = 2.0**scene.view_settings.exposure
        self._white = 1.0 if scene.view_settings.view_transform in _HARD else WHITE_RADIANCE
        self._picture: Picture | None = None
        self._texels: TexelPicture | None = None
        self._lit: tuple[TexelSurfaces, PagedSurfaces] | None = None
        self._painted: tuple[TexelPicture, float] | None = None
        self._batches: dict[float, list[tuple[bool, Any]]] = {}
        self._shader: Any = None
        self._handler = bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_VIEW")

    def show(self, picture: Picture | TexelPicture) -> None:
        """Draw this from now on; texels in place of the elements below them."""
        from ...bake.result import TexelPicture
        from .live_picture import without_texels

        if isinstance(picture, TexelPicture):
            if self._picture is not None and self._texels is None:
                self.show(without_texels(self._picture, picture.surfaces))
            self._texels = picture
        else:
            self._picture, self._batches = picture, {}

    def close(self) -> None:
        """Draw nothing any more."""
        bpy.types.SpaceView3D.draw_handler_remove(self._handler, "WINDOW")
        self._picture, self._batches, self._shader = None, {}, None
        self._texels = self._lit = self._painted = None

    def _draw(self) -> None:
        """Draw the elements into the viewport whose turn it is."""
        if (self._picture is None and self._texels is None) or bpy.context.scene.name_full != self._scene:
            return
        shading = bpy.context.space_data.shading
        exposure = self._exposure if uses_exposure(shading) else 1.0
        if self._picture is not None and exposure not in self._batches:
            self._batches[exposure] = self._upload(self._picture, exposure)
        # The two sides of a triangle lie in one place, each counter-clockwise as seen from its own.
        with over_the_objects():
            for front, batch in self._batches.get(exposure, ()):
                if front or not shading.show_backface_culling:
                    batch.draw(self._shader)
            if self._texels is not None:
                self._surfaces(self._texels, exposure).draw()

    def _surfaces(self, picture: TexelPicture, exposure: float) -> PagedSurfaces:
        """Return the texels on the graphics card: the surfaces go there once, the texels for each picture."""
        from .live_picture import page_colors

        surfaces = picture.surfaces
        if self._lit is None or self._lit[0] is not surfaces:
            self._lit = surfaces, PagedSurfaces(surfaces.corners, surfaces.uv, surfaces.page)
            self._painted = None
        if self._painted is None or self._painted != (picture, exposure):
            self._lit[1].paint(page_colors(picture, exposure, self._white))
            self._painted = picture, exposure
        return self._lit[1]

    def _upload(self, picture: Picture, exposure: float) -> list[tuple[bool, Any]]:
        """Hand the picture to the graphics card, fronts and backs apart: once, however often it is drawn."""
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


def uses_exposure(shading: bpy.types.View3DShading) -> bool:
    """Return whether a viewport will show the lightmaps with the scene's exposure.

    As Blender does: not in a material preview that is lit by a studio light alone. One that is
    solid now is taken for the material preview it can be switched to.
    """
    if shading.type == "RENDERED":
        return shading.use_scene_lights_render or shading.use_scene_world_render
    return shading.use_scene_lights or shading.use_scene_world


_view: _LiveView | None = None


def begin(scene: bpy.types.Scene) -> None:
    """Have the pictures that come drawn in all 3D viewports, about as bright as the lightmaps will be."""
    global _view
    end()
    if bpy.app.background:
        return
    _view = _LiveView(scene)
    bpy.app.handlers.load_pre.append(_end_with_the_file)


def show(picture: Picture | TexelPicture) -> None:
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
    """Return whether pictures are being drawn."""
    return _view is not None


@persistent
def _end_with_the_file(*_: object) -> None:
    """Another file is being opened: what was drawn belongs to this one."""
    end()
