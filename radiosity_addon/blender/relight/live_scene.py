"""What must stay as it is while Live follows a scene's lights: places, shapes and reflectances."""

from __future__ import annotations

import hashlib

import bpy
import numpy as np

from ...bake.scene_diff import Part, SceneDiff
from ..datablocks.bake_record import is_made
from .live_strengths import StrengthReader

SAME_MATRIX = 1e-6
"""Matrices that differ by no more than this are the same."""


class LiveScene:
    """Remembers a scene, and looks again at what Blender says has changed."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._matrix = {obj.name: _matrix(obj) for obj in scene.objects}
        self._shape = {
            obj.name: _shape(obj.data) for obj in scene.objects if isinstance(obj.data, bpy.types.Mesh)
        }
        self._objects: set[str] = set()
        self._materials: set[str] = set()

    def note(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Note what an update is of; False if it concerns nothing of ours."""
        concerns = False
        for update in depsgraph.updates:
            block = update.id
            if isinstance(block, bpy.types.Object):
                if update.is_updated_transform or update.is_updated_geometry or block.type == "LIGHT":
                    self._objects.add(block.name)
                    concerns = True
            elif isinstance(block, bpy.types.Material):
                if not is_made(block):
                    self._materials.add(block.name)
                    concerns = True
            elif isinstance(block, bpy.types.Light | bpy.types.World | bpy.types.NodeTree):
                concerns = True
        return concerns

    def diff(self, reader: StrengthReader) -> SceneDiff:
        """Return what differs of what was noted."""
        objects, self._objects = self._objects, set()
        materials, self._materials = self._materials, set()
        return SceneDiff(
            {
                Part.PLACE: [name for name in sorted(objects) if self._is_elsewhere(name)],
                Part.MATERIAL: [name for name in sorted(materials) if reader.reflects_differently(name)],
            }
        )

    def _is_elsewhere(self, name: str) -> bool:
        obj = bpy.data.objects.get(name)
        if obj is None or name not in self._matrix:
            return False
        if np.abs(_matrix(obj) - self._matrix[name]).max() > SAME_MATRIX:
            return True
        return isinstance(obj.data, bpy.types.Mesh) and self._shape.get(name) != _shape(obj.data)


def _matrix(obj: bpy.types.Object) -> np.ndarray:
    return np.array(obj.matrix_world, dtype=np.float64)


def _shape(mesh: bpy.types.Mesh) -> str:
    """A digest of where the mesh's vertices are."""
    corners = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", corners)
    return hashlib.blake2b(corners.tobytes(), digest_size=16).hexdigest()
