"""Collect what an evaluated scene holds into plain records, while the evaluation lives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ..bake_scene import LIGHTMAP_UV_LAYER, BakeWarning
from ..errors import SceneError
from ..solver.lights import Light
from .export_sources import ExportSource
from .lamps import LampFactors, read_lamp
from .materials import DEFAULT_GREY, Surface, read_material
from .mesh_arrays import MeshArrays, all_finite, not_finite_message, read_mesh
from .scene_objects import (
    is_generated,
    materials_of,
    matrix_of,
    original_object,
    source_of,
    unknown_objects,
    visible_objects,
)
from .shading_inputs import MeshValues, asked_by_material, doubts, read_mesh_inputs, read_object_inputs
from .surface_bake import can_evaluate


@dataclass(frozen=True)
class Piece:
    """One mesh at one place.

    Parameters
    ----------
    source : ExportSource
    mesh : MeshArrays
    matrix : (4, 4) float64
    surface : (t,) int32
        Rows of `Collected.surfaces`.
    asked : frozenset of str
        What its materials' nodes ask for, of those that vary; see `shading_inputs`.
    inputs : dict of str to (t, 3, 4) or (4,) float32
        What was found of it: not what follows from `mesh` and `matrix`, nor what is missing.
    bakeable : bool
        A lightmap can be assigned to it: it is a mesh and can be edited.
    linked : bool
        It would be bakeable, were it not linked from a library.
    uv_layers : int
        The UV layers of the mesh that would get another.
    has_lightmap_layer : bool
    """

    source: ExportSource
    mesh: MeshArrays
    matrix: np.ndarray
    surface: np.ndarray
    asked: frozenset[str]
    inputs: dict[str, np.ndarray]
    bakeable: bool
    linked: bool
    uv_layers: int
    has_lightmap_layer: bool

    @property
    def names(self) -> tuple[str, ...]:
        """The names by which a user may ask for it."""
        return tuple(filter(None, (self.source.name, self.source.object_name, self.source.instancer)))


@dataclass(frozen=True)
class Collected:
    """All that was found. `surfaces` and `materials` are indexed by `Piece.surface`."""

    pieces: list[Piece]
    surfaces: list[Surface]
    materials: list[bpy.types.Material | None]
    lights: list[Light]
    warnings: list[BakeWarning]


def collect(depsgraph: bpy.types.Depsgraph, factors: LampFactors) -> Collected:
    """Read meshes, materials and lamps of an evaluated scene; `factors` are those of `lamp_factors`.

    Raises
    ------
    SceneError
        If a coordinate is NaN or infinite.
    """
    collector = _Collector(depsgraph, factors)
    for instance in visible_objects(depsgraph):
        if instance.object.type == "LIGHT":
            collector.lamp(instance)
        else:
            collector.mesh(instance)
    for name, kind in unknown_objects(depsgraph).items():
        message = f"object '{name}' is {kind}; that is left out: it neither lights nor blocks"
        collector.collected.warnings.append(BakeWarning(name, message))
    return collector.collected


class _Collector:
    def __init__(self, depsgraph: bpy.types.Depsgraph, factors: LampFactors) -> None:
        self._factors = factors
        self.collected = Collected([], [], [], [], [])
        self._override = depsgraph.view_layer_eval.material_override
        self._meshes: dict[tuple[int, frozenset[str]], tuple[MeshArrays | None, MeshValues]] = {}
        self._asked: list[frozenset[str]] = []
        self._surface_of: dict[str | None, int] = {}
        self._taken = {obj.name for obj in bpy.data.objects if obj.library is None}
        self._instancers = {
            instance.parent.original.name
            for instance in visible_objects(depsgraph)
            if instance.is_instance and instance.object.type == "MESH"
        }

    def lamp(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        light, warnings = read_lamp(instance.object, matrix_of(instance), self._factors)
        self._warn(warnings)
        if light is not None:
            self.collected.lights.append(light)

    def mesh(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        shown = original_object(instance)
        matrix = matrix_of(instance)
        used, has_empty_slot = self._used_surfaces(instance)
        asked = frozenset().union(*(self._asked[row] for row in used))
        mesh, mesh_inputs = self._read(instance, asked)
        if mesh is None or not all_finite(matrix):
            raise SceneError(not_finite_message(shown.name))
        if len(mesh) == 0:
            return
        name = self._unique_name(instance)
        source = source_of(instance, name, not instance.is_instance and shown.name in self._instancers)
        owner = instance.parent.original if instance.is_instance else shown
        is_mesh = shown.type == "MESH"
        layers = (
            {layer.name for layer in shown.data.uv_layers} if is_mesh and not instance.is_instance else set()
        )
        self._warn_about(shown, owner, is_mesh)
        if has_empty_slot:
            message = f"object '{name}' has an empty material slot; grey {DEFAULT_GREY} is used"
            self._warn([BakeWarning(name, message)])
        self.collected.pieces.append(
            Piece(
                source=source,
                mesh=mesh,
                matrix=matrix,
                # A face whose slot does not exist shows the last one, as in Blender.
                surface=used[np.clip(mesh.material, 0, len(used) - 1)],
                asked=asked,
                inputs={**mesh_inputs, **read_object_inputs(instance, asked)},
                bakeable=is_mesh and owner.library is None,
                linked=is_mesh and owner.library is not None,
                uv_layers=max(mesh.uv_layers, len(layers)),
                has_lightmap_layer=mesh.lightmap_uv is not None or LIGHTMAP_UV_LAYER in layers,
            )
        )

    def _read(
        self, instance: bpy.types.DepsgraphObjectInstance, asked: frozenset[str]
    ) -> tuple[MeshArrays | None, MeshValues]:
        """Return a mesh's triangles, and what is asked of it at their corners."""
        obj = instance.object
        key = (obj.data.as_pointer(), asked)
        if key not in self._meshes:
            if is_generated(instance):
                self._meshes[key] = _read_evaluated(obj.data, asked)
            else:
                # Not `obj.data`: a window's subdivision may still be pending on the GPU.
                self._meshes[key] = _read_evaluated(obj.to_mesh(), asked)
                obj.to_mesh_clear()
        return self._meshes[key]

    def _unique_name(self, instance: bpy.types.DepsgraphObjectInstance) -> str:
        shown = original_object(instance)
        if not instance.is_instance and shown.library is None:
            return shown.name
        base = f"{instance.parent.original.name}/{shown.name}" if instance.is_instance else shown.name
        name, count = base, 0
        while name in self._taken:
            count += 1
            name = f"{base}.{count:03d}"
        self._taken.add(name)
        return name

    def _used_surfaces(self, instance: bpy.types.DepsgraphObjectInstance) -> tuple[np.ndarray, bool]:
        """Return the row of `collected.surfaces` for each slot, and whether a slot is empty."""
        if self._override is not None:
            return np.array([self._surface(self._override)], dtype=np.int32), False
        materials = materials_of(instance)
        rows = [self._surface(material) for material in materials or [None]]
        return np.array(rows, dtype=np.int32), any(material is None for material in materials)

    def _surface(self, material: bpy.types.Material | None) -> int:
        key = None if material is None else material.original.name_full
        if key not in self._surface_of:
            surface = read_material(material)
            self._surface_of[key] = len(self.collected.surfaces)
            self.collected.surfaces.append(surface)
            self.collected.materials.append(material and material.original)
            self._asked.append(
                asked_by_material(material.node_tree) if material and surface.varies else frozenset()
            )
            self._warn(surface.warnings)
            if material is not None and surface.varies:
                said = [
                    BakeWarning(material.name, f"material '{material.name}': {doubt}")
                    for doubt in doubts(material.node_tree)
                ]
                self._warn(said if can_evaluate() else surface.fallbacks)
        return self._surface_of[key]

    def _warn_about(self, shown: bpy.types.Object, owner: bpy.types.Object, is_mesh: bool) -> None:
        if not is_mesh:
            self._warn([_unlit(shown.name, "is not a mesh", "convert it to one")])
        elif owner.library is not None:
            self._warn(
                [_unlit(owner.name, "is linked from a library", "make it local or a library override")]
            )
        for kind in ("shadow", "diffuse"):
            if not getattr(shown, f"visible_{kind}"):
                message = f"'Ray Visibility: {kind.title()}' off is ignored: it lights and blocks"
                self._warn([BakeWarning(shown.name, f"object '{shown.name}': {message}")])

    def _warn(self, warnings: Sequence[BakeWarning]) -> None:
        self.collected.warnings.extend(warnings)


def _read_evaluated(mesh: bpy.types.Mesh, asked: frozenset[str]) -> tuple[MeshArrays | None, MeshValues]:
    arrays = read_mesh(mesh)
    return arrays, {} if arrays is None else read_mesh_inputs(mesh, arrays.loops, asked)


def _unlit(name: str, why: str, mend: str) -> BakeWarning:
    what = f"object '{name}' {why}: it lights and blocks but gets no lightmap"
    return BakeWarning(name, f"{what}; {mend} to bake it")
