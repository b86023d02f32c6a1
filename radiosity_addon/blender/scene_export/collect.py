"""Collect what an evaluated scene holds into plain records, while the evaluation lives.

The scene is shown as a render would show it only for moments: what is found is copied as it is, as much as
fits into a moment, and made sense of afterward (`sorted_out`). Nothing that outlives a moment points into
the file: it may be edited before the next.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Generator, Hashable, Iterator, Sequence
from contextlib import AbstractContextManager

import bpy
import numpy as np

from ...base import BakeWarning, SceneError
from ...lights import Light
from ...options import BakeSettings
from ..cycles.lamps import LampFactors, read_lamp
from ..cycles.surface_bake import can_evaluate
from ..datablocks.image_values import ImageKey, ImageMeans, UnknownMeanError, known_means_only, mean_of_named
from ..datablocks.mesh_arrays import MeshArrays, RawMesh, copy_mesh_data, mesh_arrays, no_triangles
from ..materials.gloss import ALL, Gloss
from ..materials.materials import Surface, ray_doubts, read_material, uses_nodes
from ..materials.shading_inputs import (
    MeshValues,
    asked_by_material,
    eevee_only,
    read_mesh_inputs,
    read_object_inputs,
    unreliable_nodes,
)
from ..scene_records.export_sources import MaterialSource
from ..scene_records.glass import lets_light_through
from ..scene_records.light_linking import linking_warnings
from ..scene_records.light_membership import Membership, PlaceGroups, name_on
from ..scene_records.object_roles import BAKE, BAKEABLE_TYPES, IGNORE, role_of
from ..scene_records.pieces import Found, SceneContents, names_of, piece_of
from ..scene_records.render_state import background_scenes
from ..scene_records.scene_objects import (
    identity_of,
    is_generated,
    materials_of,
    matrix_of,
    original_object,
    source_of,
    unknown_objects,
    visible_objects,
)
from .levels_of_detail import share_levels

MOMENT, NO_WINDOW_MOMENT = 0.05, 1.0
"""Seconds for which the scene is shown as a render would, if that is enough to read an object: while a window
waits, and without one. Showing it takes time again each time."""

View = Callable[[], AbstractContextManager[bpy.types.Depsgraph]]
"""Shows the scene as a render would, while it is entered."""

_Key = Hashable


def collect(
    depsgraph: bpy.types.Depsgraph,
    factors: LampFactors,
    settings: BakeSettings | None = None,
    dark: bool = False,
) -> SceneContents:
    """Read meshes, materials and lamps of an evaluated scene; `factors` are those of `lamp_factors`.

    `settings.ignore` and `settings.light_only` name objects to leave out, or without lightmaps; `dark` takes
    lamps without power too.

    Raises SceneError if a coordinate is NaN or infinite.
    """
    collector = _Collector(factors, settings or BakeSettings(), dark)
    collector.look(depsgraph, float("inf"))
    return collector.sorted_out()


def collect_steps(
    view: View, factors: LampFactors, settings: BakeSettings, dark: bool, in_background: bool = False
) -> Generator[float, None, Callable[[], SceneContents]]:
    """Copy meshes, materials and lamps of a scene, as much a step as fits into a moment.

    view: Shows the scene, for a step.
    factors, settings, dark: As for `collect`.
    in_background: Whether a window waits.
    Returns sorted_out: Works on what was copied alone, in any thread; raises SceneError if a coordinate is
        NaN or infinite.
    Raises SceneError if the add-on Cycles is disabled.
    """
    collector = _Collector(factors, settings, dark)
    means: ImageMeans = {}
    moment = MOMENT if in_background else NO_WINDOW_MOMENT
    while True:
        began = time.perf_counter()
        with view() as depsgraph, known_means_only(means):
            until = max(began + moment, time.perf_counter() + moment / 2)
            done = collector.look(depsgraph, until)
        if done:
            return collector.sorted_out
        yield collector.fraction
        for wanted in sorted(collector.wanted - means.keys()):
            means[wanted] = yield from mean_of_named(wanted)


class _Collector:
    """Copies what it sees, look by look, and sorts it out in the end."""

    def __init__(self, factors: LampFactors, settings: BakeSettings, dark: bool) -> None:
        self._factors, self._dark = factors, dark
        self._settings, self._gloss = settings, ALL
        self._found: dict[_Key, Found] = {}
        self._lights: dict[_Key, tuple[Light | None, str, tuple[BakeWarning, ...]]] = {}
        self._names: dict[_Key, str] = {}
        self._order: list[_Key] = []
        self._unknown: list[BakeWarning] = []
        self._surfaces: list[tuple[Surface, MaterialSource | None, list[BakeWarning], frozenset[str]]] = []
        self._surface_of: dict[str | None, int] = {}
        # A curve's mesh comes as an instance, and may have the curve's own name.
        self._taken = {obj.name for obj in bpy.data.objects if obj.library is None and obj.type == "MESH"}
        self.wanted: set[ImageKey] = set()
        """Images whose means are needed before the surfaces that show them can be read."""

    @property
    def fraction(self) -> float:
        """How much was found of what was there in the last look."""
        return (len(self._found) + len(self._lights)) / max(len(self._order), 1)

    def look(self, depsgraph: bpy.types.Depsgraph, until: float) -> bool:
        """Copy what was not seen before, until a point in time (`perf_counter`); True if that is all."""
        self._prepare(depsgraph)
        complete, looked = True, False
        for key, instance in _with_keys(depsgraph):
            if key in self._found or key in self._lights:
                continue
            if looked and time.perf_counter() > until:
                return False
            looked = True
            try:
                if instance.object.type == "LIGHT":
                    self._lights[key] = self._lamp(instance)
                else:
                    self._found[key] = self._mesh(instance, self._names[key])
            except UnknownMeanError as missing:
                self.wanted.add(missing.wanted)
                complete = False
        for name, kind in unknown_objects(depsgraph).items() if complete else ():
            message = f"object '{name}' is {kind}; that is left out: it neither lights nor blocks"
            self._unknown.append(BakeWarning(name, message))
        return complete

    def sorted_out(self) -> SceneContents:
        """Return what was found and is still there, in the scene's order; needs no Blender."""
        collected = SceneContents([], [], [], [], [], [], self._cameras)
        rows: dict[int, int] = {}
        read: dict[int, MeshArrays | None] = {}
        for key in self._order:
            if key in self._lights:
                light, group, warnings = self._lights[key]
                collected.warnings.extend(warnings)
                if light is not None:
                    collected.lights.append(light)
                    collected.groups.append(group)
            elif key in self._found:
                found = self._found[key]
                for row in found.slots.tolist():
                    if row not in rows:
                        rows[row] = len(rows)
                        surface, material, warnings, _ = self._surfaces[row]
                        collected.surfaces.append(surface)
                        collected.materials.append(material)
                        collected.warnings.extend(warnings)
                if found.raw is not None and id(found.raw) not in read:
                    read[id(found.raw)] = mesh_arrays(found.raw)
                mesh = no_triangles() if found.raw is None else read[id(found.raw)]
                own = np.array([rows[row] for row in found.slots.tolist()], dtype=np.int32)
                piece = piece_of(found, mesh, own, collected)
                if piece is not None:
                    collected.pieces.append(piece)
        collected.warnings.extend(self._unknown)
        share_levels(collected)
        return collected

    def _prepare(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Note what holds as long as the scene is evaluated, and name what is new in it."""
        self._membership = Membership(depsgraph.scene.original)
        if not hasattr(depsgraph.scene.original, "cycles"):
            raise SceneError(
                "the add-on Cycles is disabled, which evaluates materials: enable it in Preferences → Add-ons"
            )
        self._gloss = Gloss.of(depsgraph.scene.original)
        self._override = depsgraph.view_layer_eval.material_override
        self._meshes: dict[tuple[int, frozenset[str]], tuple[RawMesh, MeshValues]] = {}
        everything = depsgraph.scene_eval.objects
        self._cameras = [tuple(obj.matrix_world.translation) for obj in everything if obj.type == "CAMERA"]
        layer = depsgraph.view_layer
        self._held_out = {obj.name_full for obj in layer.objects if obj.holdout_get(view_layer=layer)}
        own = {obj.name_full for obj in layer.objects}
        self._background = {
            obj.name_full: scene.name
            for scene in background_scenes(depsgraph.scene)
            for obj in scene.objects
            if obj.name_full not in own
        }
        self._instancers = set()
        self._order = []
        for key, instance in _with_keys(depsgraph):
            self._order.append(key)
            if instance.object.type != "MESH":
                continue
            if key not in self._names:
                self._names[key] = self._unique_name(instance)
            if instance.is_instance:
                self._instancers.add(instance.parent.original.name)

    def _lamp(
        self, instance: bpy.types.DepsgraphObjectInstance
    ) -> tuple[Light | None, str, tuple[BakeWarning, ...]]:
        light, warnings = read_lamp(instance.object, matrix_of(instance), self._factors, self._dark)
        return light, self._groups(instance).of_lamp, warnings

    def _mesh(self, instance: bpy.types.DepsgraphObjectInstance, name: str) -> Found:
        shown = original_object(instance)
        owner = instance.parent.original if instance.is_instance else shown
        source = source_of(instance, name, not instance.is_instance and shown.name in self._instancers)
        held_out = owner.name_full in self._held_out
        background = self._background.get(owner.name_full)
        role = role_of(shown, owner, names_of(source), self._settings, held_out, background)
        can_bake = role.mode == BAKE and shown.type in BAKEABLE_TYPES
        raw, slots = None, np.zeros(0, dtype=np.int32)
        empty: tuple[bool, ...] = ()
        asked: frozenset[str] = frozenset()
        mesh_inputs: MeshValues = {}
        # What is ignored stays known: it must still be shown where its instancer will be hidden.
        if role.mode != IGNORE:
            slots, empty = self._slots(instance)
            asked = frozenset().union(*(self._surfaces[row][3] for row in slots.tolist()))
            raw, mesh_inputs = self._read(instance, asked)
        is_mesh = shown.type == "MESH" and not instance.is_instance
        return Found(
            source=source,
            shown=shown.name,
            raw=raw,
            matrix=matrix_of(instance),
            slots=slots,
            empty=empty,
            role=role,
            asked=asked,
            mesh_inputs=mesh_inputs,
            inputs=read_object_inputs(instance, asked) if asked else {},
            can_bake=can_bake,
            library=owner.library is not None,
            owner=owner.name,
            layers=frozenset(layer.name for layer in shown.data.uv_layers) if is_mesh else frozenset(),
            linking=tuple(linking_warnings(shown, "emissive object")),
            groups=self._groups(instance),
        )

    def _groups(self, instance: bpy.types.DepsgraphObjectInstance) -> PlaceGroups:
        shown = original_object(instance)
        return self._membership.at(shown, instance.parent.original if instance.is_instance else shown)

    def _read(
        self, instance: bpy.types.DepsgraphObjectInstance, asked: frozenset[str]
    ) -> tuple[RawMesh, MeshValues]:
        """Return a mesh's data, and the inputs of its materials at its triangles' corners."""
        obj = instance.object
        key = (obj.data.as_pointer(), asked)
        if key not in self._meshes:
            if is_generated(instance):
                self._meshes[key] = _copy_evaluated(obj.data, asked)
            else:
                # Not `obj.data`: a window's subdivision may still be pending on the GPU.
                self._meshes[key] = _copy_evaluated(obj.to_mesh(), asked)
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

    def _slots(self, instance: bpy.types.DepsgraphObjectInstance) -> tuple[np.ndarray, tuple[bool, ...]]:
        """Return the surface of each material slot, (s,) int32, and which slots are empty."""
        if self._override is not None:
            return np.array([self._surface(self._override)], dtype=np.int32), ()
        materials = materials_of(instance)
        rows = [self._surface(material) for material in materials or [None]]
        return np.array(rows, dtype=np.int32), tuple(material is None for material in materials)

    def _surface(self, material: bpy.types.Material | None) -> int:
        key = None if material is None else material.original.name_full
        if key not in self._surface_of:
            lets_through = lets_light_through(material, self._settings)
            surface = read_material(material, lets_through, self._gloss)
            asked: frozenset[str] = frozenset()
            warnings = list(surface.warnings)
            if material is not None and uses_nodes(material):
                warnings += _warnings_of(material, eevee_only(material.node_tree))
                warnings += _warnings_of(material, ray_doubts(material, surface))
            if material is not None and surface.varies:
                asked = asked_by_material(material.node_tree)
                unreliable = _warnings_of(material, unreliable_nodes(material.node_tree))
                warnings += unreliable if can_evaluate() else surface.fallbacks
            self._surface_of[key] = len(self._surfaces)
            source = None
            if material is not None:
                original = material.original
                source = MaterialSource.of(original, name_on(original), lets_through, self._gloss)
            self._surfaces.append((surface, source, warnings, asked))
        return self._surface_of[key]


def _with_keys(
    depsgraph: bpy.types.Depsgraph,
) -> Iterator[tuple[_Key, bpy.types.DepsgraphObjectInstance]]:
    """Yield the objects that a scene shows, each with a key that is unique as long as nothing is renamed."""
    seen: Counter[_Key] = Counter()
    for instance in visible_objects(depsgraph):
        identity = identity_of(instance)
        seen[identity] += 1
        yield (identity, seen[identity]), instance


def _warnings_of(material: bpy.types.Material, messages: Sequence[str]) -> list[BakeWarning]:
    return [BakeWarning(material.name, f"material '{material.name}': {message}") for message in messages]


def _copy_evaluated(mesh: bpy.types.Mesh, asked: frozenset[str]) -> tuple[RawMesh, MeshValues]:
    raw = copy_mesh_data(mesh)
    return raw, read_mesh_inputs(mesh, raw.loops, asked) if asked else {}
