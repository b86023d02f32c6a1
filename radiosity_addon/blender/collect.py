"""Collect what an evaluated scene holds into plain records, while the evaluation lives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ..bake_scene import LIGHTMAP_UV_LAYER, BakeWarning
from ..errors import SceneError
from ..settings import BakeSettings
from ..solver.lights import Light
from .export_sources import ExportSource
from .lamps import LampFactors, read_lamp
from .light_linking import linking_warnings
from .light_membership import Membership, PlaceGroups
from .materials import DEFAULT_GREY, Surface, ray_doubts, read_material, uses_nodes
from .mesh_arrays import MeshArrays, all_finite, no_triangles, not_finite_message, read_mesh
from .object_roles import BAKE, BAKEABLE_TYPES, IGNORE, Role, role_of
from .render_state import background_scenes
from .scene_objects import (
    is_generated,
    materials_of,
    matrix_of,
    original_object,
    source_of,
    unknown_objects,
    visible_objects,
)
from .shading_inputs import (
    MeshValues,
    asked_by_material,
    doubts,
    eevee_only,
    read_mesh_inputs,
    read_object_inputs,
)
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
    role : Role
        Of what is ignored, `mesh` is empty.
    asked : frozenset of str
        What its materials' nodes ask for, of those that vary; see `shading_inputs`.
    inputs : dict of str to (t, 3, 4) or (4,) float32
        What was found of it: not what follows from `mesh` and `matrix`, nor what is missing.
    bakeable : bool
        It is to have a lightmap, if it is asked for, and can: it may be edited.
    linked : bool
        It would be bakeable, were it not linked from a library.
    uv_layers : int
        The UV layers of the mesh that would get another.
    has_lightmap_layer : bool
    linking : tuple of BakeWarning
        What is not followed, should it emit.
    groups : PlaceGroups
        The light group of what it emits.
    """

    source: ExportSource
    mesh: MeshArrays
    matrix: np.ndarray
    surface: np.ndarray
    role: Role
    asked: frozenset[str]
    inputs: dict[str, np.ndarray]
    bakeable: bool
    linked: bool
    uv_layers: int
    has_lightmap_layer: bool
    linking: tuple[BakeWarning, ...]
    groups: PlaceGroups

    @property
    def names(self) -> tuple[str, ...]:
        """The names by which a user may ask for it."""
        return _names(self.source)


@dataclass(frozen=True)
class _Contents:
    """What a piece holds; see there."""

    mesh: MeshArrays
    surface: np.ndarray
    asked: frozenset[str]
    inputs: dict[str, np.ndarray]


_NOTHING = _Contents(no_triangles(), np.zeros(0, dtype=np.int32), frozenset(), {})


@dataclass(frozen=True)
class Collected:
    """All that was found. `surfaces` and `materials` are indexed by `Piece.surface`.

    `groups` are the lights' light groups, parallel to them, "" for those in none.
    """

    pieces: list[Piece]
    surfaces: list[Surface]
    materials: list[bpy.types.Material | None]
    lights: list[Light]
    warnings: list[BakeWarning]
    groups: list[str]


def collect(
    depsgraph: bpy.types.Depsgraph,
    factors: LampFactors,
    settings: BakeSettings | None = None,
    dark: bool = False,
) -> Collected:
    """Read meshes, materials and lamps of an evaluated scene; `factors` are those of `lamp_factors`.

    `settings.ignore` and `settings.light_only` name objects to leave out, or without lightmaps; `dark` takes
    lamps without power too.

    Raises
    ------
    SceneError
        If a coordinate is NaN or infinite.
    """
    collector = _Collector(depsgraph, factors, settings or BakeSettings(), dark)
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
    def __init__(
        self, depsgraph: bpy.types.Depsgraph, factors: LampFactors, settings: BakeSettings, dark: bool
    ) -> None:
        self._factors, self._dark = factors, dark
        self._settings = settings
        self.collected = Collected([], [], [], [], [], [])
        self._membership = Membership(depsgraph.scene.original)
        self._override = depsgraph.view_layer_eval.material_override
        self._meshes: dict[tuple[int, frozenset[str]], tuple[MeshArrays | None, MeshValues]] = {}
        self._asked: list[frozenset[str]] = []
        self._surface_of: dict[str | None, int] = {}
        # A curve's mesh comes as an instance, and may have the curve's own name.
        self._taken = {obj.name for obj in bpy.data.objects if obj.library is None and obj.type == "MESH"}
        layer = depsgraph.view_layer
        self._held_out = {obj.name_full for obj in layer.objects if obj.holdout_get(view_layer=layer)}
        own = {obj.name_full for obj in layer.objects}
        self._background = {
            obj.name_full: scene.name
            for scene in background_scenes(depsgraph.scene)
            for obj in scene.objects
            if obj.name_full not in own
        }
        self._instancers = {
            instance.parent.original.name
            for instance in visible_objects(depsgraph)
            if instance.is_instance and instance.object.type == "MESH"
        }

    def lamp(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        light, warnings = read_lamp(instance.object, matrix_of(instance), self._factors, self._dark)
        self._warn(warnings)
        if light is not None:
            self.collected.lights.append(light)
            self.collected.groups.append(self._groups(instance).of_lamp)

    def mesh(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        shown = original_object(instance)
        matrix = matrix_of(instance)
        owner = instance.parent.original if instance.is_instance else shown
        name = self._unique_name(instance)
        source = source_of(instance, name, not instance.is_instance and shown.name in self._instancers)
        held_out = owner.name_full in self._held_out
        background = self._background.get(owner.name_full)
        role = role_of(shown, owner, _names(source), self._settings, held_out, background)
        # What is ignored stays known: it must still be shown where its instancer will be hidden.
        contents = _NOTHING if role.mode == IGNORE else self._contents(instance)
        if contents is not None and self._is_fog(contents):
            role, contents = replace(role, mode=IGNORE), _NOTHING
        if contents is None or not all_finite(matrix):
            raise SceneError(not_finite_message(shown.name))
        mesh = contents.mesh
        if len(mesh) == 0 and role.mode != IGNORE:
            return
        self._warn_of_empty_slots(instance, name, mesh)
        can_bake = role.mode == BAKE and shown.type in BAKEABLE_TYPES
        is_mesh = shown.type == "MESH"
        layers = (
            {layer.name for layer in shown.data.uv_layers} if is_mesh and not instance.is_instance else set()
        )
        if can_bake and owner.library is not None:
            self._warn([_linked(owner.name)])
        self._warn(role.warnings)
        self.collected.pieces.append(
            Piece(
                source=source,
                mesh=mesh,
                matrix=matrix,
                surface=contents.surface,
                asked=contents.asked,
                inputs=contents.inputs,
                role=role,
                bakeable=can_bake and owner.library is None,
                linked=can_bake and owner.library is not None,
                uv_layers=max(mesh.uv_layers, len(layers)),
                has_lightmap_layer=mesh.lightmap_uv is not None or LIGHTMAP_UV_LAYER in layers,
                linking=tuple(linking_warnings(shown, "emissive object")),
                groups=self._groups(instance),
            )
        )

    def _groups(self, instance: bpy.types.DepsgraphObjectInstance) -> PlaceGroups:
        shown = original_object(instance)
        return self._membership.at(shown, instance.parent.original if instance.is_instance else shown)

    def _is_fog(self, contents: _Contents) -> bool:
        """Tell whether all there is of a mesh is what fills it."""
        shown = np.unique(contents.surface)
        return len(shown) > 0 and all(self.collected.surfaces[row].is_volume for row in shown)

    def _contents(self, instance: bpy.types.DepsgraphObjectInstance) -> _Contents | None:
        """Read the mesh and what it shows; None if a coordinate is NaN or infinite."""
        slots = self._slots(instance)
        asked = frozenset().union(*(self._asked[row] for row in slots))
        mesh, inputs = self._read(instance, asked)
        if mesh is None:
            return None
        # A face whose slot does not exist shows the last one, as in Blender.
        surface = slots[np.clip(mesh.material, 0, len(slots) - 1)]
        return _Contents(mesh, surface, asked, {**inputs, **read_object_inputs(instance, asked)})

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
        own = not instance.is_instance or (shown.type != "MESH" and instance.parent.original == shown)
        base = shown.name if own else f"{instance.parent.original.name}/{shown.name}"
        name, count = base, 0
        while name in self._taken:
            count += 1
            name = f"{base}.{count:03d}"
        self._taken.add(name)
        return name

    def _slots(self, instance: bpy.types.DepsgraphObjectInstance) -> np.ndarray:
        """Return the row of `collected.surfaces` for each material slot, (s,) int32."""
        if self._override is not None:
            return np.array([self._surface(self._override)], dtype=np.int32)
        materials = materials_of(instance)
        rows = [self._surface(material) for material in materials or [None]]
        return np.array(rows, dtype=np.int32)

    def _warn_of_empty_slots(
        self, instance: bpy.types.DepsgraphObjectInstance, name: str, mesh: MeshArrays
    ) -> None:
        materials = [] if self._override is not None else materials_of(instance)
        used = np.unique(np.clip(mesh.material, 0, max(len(materials) - 1, 0)))
        if any(materials[slot] is None for slot in used if slot < len(materials)):
            message = f"object '{name}' has an empty material slot; grey {DEFAULT_GREY} is used"
            self._warn([BakeWarning(name, message)])

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
            if material is not None and uses_nodes(material):
                self._warn(_told_of(material, eevee_only(material.node_tree)))
                self._warn(_told_of(material, ray_doubts(material, surface)))
            if material is not None and surface.varies:
                said = _told_of(material, doubts(material.node_tree))
                self._warn(said if can_evaluate() else surface.fallbacks)
        return self._surface_of[key]

    def _warn(self, warnings: Sequence[BakeWarning]) -> None:
        self.collected.warnings.extend(warnings)


def _told_of(material: bpy.types.Material, messages: Sequence[str]) -> list[BakeWarning]:
    return [BakeWarning(material.name, f"material '{material.name}': {message}") for message in messages]


def _read_evaluated(mesh: bpy.types.Mesh, asked: frozenset[str]) -> tuple[MeshArrays | None, MeshValues]:
    arrays = read_mesh(mesh)
    return arrays, {} if arrays is None else read_mesh_inputs(mesh, arrays.loops, asked)


def _names(source: ExportSource) -> tuple[str, ...]:
    """Return the names by which a user may ask for what a source shows."""
    return tuple(filter(None, (source.name, source.object_name, source.instancer)))


def _linked(name: str) -> BakeWarning:
    what = f"object '{name}' is linked from a library: it lights and blocks but gets no lightmap"
    return BakeWarning(name, f"{what}; make it local or a library override to bake it")
