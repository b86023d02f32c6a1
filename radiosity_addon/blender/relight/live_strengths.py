"""Strengths of a kept bake's sources as the file has them now, without exporting the scene.

Lamps, materials and the world are read as constants. Where nodes make a light vary, only Cycles
knows its strength, but its constant still follows its sliders: then the ratio to its first value is used.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...bake.relight import KeptBake
from ...bake.scene_diff import RELIGHTABLE, Part, SceneDiff, differs_in_strength_alone
from ...lights import EnvironmentLight, Light, SkyPatch
from ...numerics import Array
from ..cycles.lamps import read_lamp
from ..materials.light_inputs import shown_world
from ..materials.materials import read_material, read_radiance, uses_nodes

SAME_STRENGTH = 1e-5
"""A constant that is off by no more than this part is what the export found."""


class StrengthReader:
    """Reads the strengths of a scene's sources.

    strengths (s, 3): What the export of the scene as it is now found.
    """

    def __init__(self, scene: bpy.types.Scene, kept: KeptBake, strengths: Array) -> None:
        self._scene, self._kept, self._given = scene.name_full, kept, strengths
        self._lamps = {
            light.name: _lamp(light.name)
            for light in kept.bake_scene.scene.lights
            if not _is_of_sky(light) and bpy.data.objects.get(light.name) is not None
        }
        self._reflectance: dict[str, Array] = {
            material.name: read_material(material).reflectance for material in bpy.data.materials
        }
        self._first = self._constants()
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.abs(self._first - strengths) > SAME_STRENGTH * np.abs(strengths).max(
                axis=1, keepdims=True
            )
        self._varies = off.any(axis=1)

    def read(self) -> Array:
        """Return (s, 3) the strengths.

        Raises SceneError if a source has changed in more than its strength.
        """
        now = self._constants()
        known = self._first > 0
        ratio = np.where(known, now / np.where(known, self._first, 1.0), 0.0)
        return np.where(self._varies[:, None], self._given * ratio, now)

    def reflects_differently(self, name: str) -> bool:
        """Return whether a material reflects differently than at the start."""
        material, before = bpy.data.materials.get(name), self._reflectance.get(name)
        if material is None or before is None:
            return False
        return bool(np.abs(read_material(material).reflectance - before).max() > SAME_STRENGTH)

    def _constants(self) -> Array:
        """Return (s, 3) the sources' strengths as far as constants determine them."""
        lights = self._kept.bake_scene.scene.lights
        rows = [self._of_light(light) for light in lights]
        rows += [_of_material(name) for name in self._kept.names[len(lights) :]]
        return np.array(rows, dtype=np.float64).reshape(-1, 3)

    def _of_light(self, light: Light) -> Array:
        if _is_of_sky(light):
            return self._of_world(light.name)
        before = self._lamps.get(light.name)
        now = _lamp(light.name)
        if now is None or before is None:
            return np.zeros(3)
        if not differs_in_strength_alone(before, now):
            SceneDiff({Part.LIGHT: [light.name]}).refuse_all_but(RELIGHTABLE)
        return now.strength

    def _of_world(self, name: str) -> Array:
        world = shown_world(bpy.data.scenes[self._scene], name)
        if world is None:
            return np.zeros(3)
        if not uses_nodes(world):
            return np.array(world.color[:3], dtype=np.float64)
        return read_radiance(world, "world")[0]


def _is_of_sky(light: Light) -> bool:
    return isinstance(light, EnvironmentLight | SkyPatch)


def _lamp(name: str) -> Light | None:
    """Return a lamp object as a light, without what only Cycles knows of its nodes; None if it is hidden."""
    obj = bpy.data.objects.get(name)
    if obj is None or obj.type != "LIGHT" or obj.hide_render:
        return None
    return read_lamp(obj, np.array(obj.matrix_world, dtype=np.float64), {}, dark=True)[0]


def _of_material(name: str) -> Array:
    material = bpy.data.materials.get(name)
    return np.zeros(3) if material is None else read_material(material).emission
