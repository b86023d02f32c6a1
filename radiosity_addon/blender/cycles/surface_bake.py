"""A temporary scene in which Cycles evaluates materials.

One mesh in it holds triangles of many objects, and copies of their materials emit the quantity
to evaluate: a bake of emission at one sample is exact. Nothing that was in the file is changed,
and everything that is added is removed again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...base import BakeError
from ...lightmap.images import SurfaceTiles
from ...options import BakeSettings
from ..datablocks.bake_record import remove_datablocks
from ..scene_records.export_sources import MaterialSource
from .surface_rewiring import RewiredMaterial

_PIXEL_OFFSET = np.array([0.001, 0.002])
"""Blender samples this far from the centers of texels."""

_UV_LAYER = "Tiles"


def can_evaluate() -> bool:
    """Return whether this Blender has Cycles."""
    return hasattr(bpy.types.Scene, "cycles")


@dataclass(frozen=True, eq=False)
class DrawnSurfaces:
    """The mesh of the triangles that vary, n of them.

    size (int, int): Width and height of the image.
    corners (n, 3, 3) float32.
    uv (n, 3, 2) float32: In the image, their tiles.
    inputs dict of str to (n, 3, 4) float32: Inputs of the nodes.
    surface (n,) int.
    """

    size: tuple[int, int]
    corners: np.ndarray
    uv: np.ndarray
    inputs: dict[str, np.ndarray]
    surface: np.ndarray


def drawn_surfaces(
    tiles: SurfaceTiles,
    corners: np.ndarray,
    inputs: Mapping[str, np.ndarray],
    surface: np.ndarray,
) -> DrawnSurfaces:
    """Return the mesh of triangles that have tiles; works on arrays alone."""
    coordinates, weights = tiles.drawn_triangles()
    size = np.array([tiles.width, tiles.height])
    return DrawnSurfaces(
        (tiles.width, tiles.height),
        _at_weights(corners, weights),
        (coordinates + _PIXEL_OFFSET / size).astype(np.float32),
        {name: _at_weights(values, weights) for name, values in inputs.items()},
        surface,
    )


class SurfaceBake:
    """A temporary scene of one mesh and copies of materials.

    materials mapping of int to MaterialSource or None: Those to evaluate, by their surface.
    inputs: Inputs of their nodes.
    """

    def __init__(
        self,
        context: bpy.types.Context,
        settings: BakeSettings,
        materials: Mapping[int, MaterialSource | None],
        inputs: Sequence[str],
    ) -> None:
        self._context = context
        self._made: list[bpy.types.ID] = []
        self._attributes = attribute_names(inputs)
        self._rewired: dict[int, RewiredMaterial] = {}
        try:
            for row, source in materials.items():
                if source is None:
                    continue
                self._rewired[row] = RewiredMaterial(
                    source.find(), self._attributes, source.lets_through, source.gloss
                )
                self._made += self._rewired[row].made
            self._scene = _new_scene(context.scene, context.view_layer, settings)
            self._made.append(self._scene)
        except BaseException:
            self.close()
            raise

    def draw(self, drawn: DrawnSurfaces) -> None:
        """Make the mesh and the image."""
        mesh = bpy.data.meshes.new("Radiosity Surfaces")
        self._made.append(mesh)
        _fill_mesh(mesh, drawn.corners)
        layer = mesh.uv_layers.new(name=_UV_LAYER)
        layer.uv.foreach_set("vector", drawn.uv.ravel())
        for name, values in drawn.inputs.items():
            attribute = mesh.attributes.new(self._attributes[name], "FLOAT_COLOR", "CORNER")
            attribute.data.foreach_set("color", values.ravel())
        slots = np.zeros(max(self._rewired) + 1, dtype=np.int32)
        slots[list(self._rewired)] = np.arange(len(self._rewired))
        for rewired in self._rewired.values():
            mesh.materials.append(rewired.material)
        mesh.polygons.foreach_set("material_index", slots[drawn.surface])
        mesh.update()
        self._object = bpy.data.objects.new("Radiosity Surfaces", mesh)
        self._made.append(self._object)
        self._scene.collection.objects.link(self._object)
        self._image = bpy.data.images.new("Radiosity Surfaces", *drawn.size, float_buffer=True, is_data=True)
        self._made.append(self._image)

    def channel(self, channel: str) -> np.ndarray:
        """Return one channel, (h, w, 3) float32; 0 where nothing is drawn."""
        width, height = self._image.size
        for rewired in self._rewired.values():
            rewired.show(channel, self._image)
        layer, obj = self._scene.view_layers[0], self._object
        with self._context.temp_override(
            scene=self._scene, view_layer=layer, object=obj, active_object=obj, selected_objects=[obj]
        ):
            done = bake_emission()
        if done != {"FINISHED"}:
            raise BakeError("Cycles could not evaluate the materials")
        pixels = np.empty(width * height * 4, dtype=np.float32)
        self._image.pixels.foreach_get(pixels)
        return pixels.reshape(height, width, 4)[..., :3]

    def close(self) -> None:
        """Remove everything from the file."""
        remove_datablocks(self._made)
        self._made.clear()


def attribute_names(inputs: Sequence[str]) -> dict[str, str]:
    """Return the mesh attribute of each input of the nodes."""
    return {name: f"radiosity_{number}" for number, name in enumerate(inputs)}


def bake_emission() -> set[str]:
    """Let Cycles bake the active object's emission into its materials' active images."""
    return bpy.ops.object.bake(
        type="EMIT",
        margin=0,
        use_clear=True,
        target="IMAGE_TEXTURES",
        save_mode="INTERNAL",
        use_selected_to_active=False,
        uv_layer=_UV_LAYER,
    )


def _copy_numbers(owner: bpy.types.bpy_struct, to: bpy.types.bpy_struct) -> None:
    """Copy custom properties that Attribute nodes of the view layer can read."""
    for name, value in owner.items():
        if isinstance(value, (int, float)) or (hasattr(value, "typecode") and len(value) <= 4):
            to[name] = value


def _new_scene(shown: bpy.types.Scene, layer: bpy.types.ViewLayer, settings: BakeSettings) -> bpy.types.Scene:
    scene = bpy.data.scenes.new("Radiosity Surfaces")
    scene.frame_current, scene.frame_subframe = shown.frame_current, shown.frame_subframe
    _copy_numbers(shown, scene)
    _copy_numbers(layer, scene.view_layers[0])
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 1
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    if settings.threads:
        scene.render.threads_mode, scene.render.threads = "FIXED", settings.threads
    return scene


def _at_weights(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Carry values (n, 3, k) of triangles' corners to three points given by weights (n, 3, 2)."""
    steps = values[:, 1:] - values[:, :1]
    return (values[:, :1] + np.einsum("npc,nck->npk", weights, steps)).astype(np.float32)


def _fill_mesh(mesh: bpy.types.Mesh, corners: np.ndarray) -> None:
    """Give an empty mesh triangles (n, 3, 3) float32 that share no vertex."""
    count = len(corners)
    mesh.vertices.add(3 * count)
    mesh.loops.add(3 * count)
    mesh.polygons.add(count)
    mesh.vertices.foreach_set("co", corners.ravel())
    mesh.loops.foreach_set("vertex_index", np.arange(3 * count, dtype=np.int32))
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
