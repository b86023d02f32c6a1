"""Blender lamps as the solver's lights, in the units Cycles renders them with."""

from __future__ import annotations

import math
from collections.abc import Generator

import bpy
import numpy as np

from ...base import BakeWarning, SceneError
from ...lights import AreaLight, Light, PointLight, SpotLight, SunLight
from ...numerics import cone_projected_solid_angle, sphere_area
from ..datablocks.image_values import known_means_only
from ..datablocks.mesh_arrays import all_finite
from ..materials.materials import read_radiance, uses_nodes
from ..materials.shading_inputs import asks_light_path
from ..scene_records.light_linking import linking_warnings
from .lamp_pixels import lamp_factor

_SAME_SCALE = 1e-4  # relative difference of axes below which a scale counts as uniform
_EVEN = 0.02  # relative variation with direction below which a lamp's nodes count as constant

ALL_BOUNCES = 1024
"""Cycles' default for a lamp's limit of bounces."""

LampFactors = dict[str, tuple[np.ndarray, float]]
"""The factor of each lamp's nodes (see `lamp_factor`), by its full name."""


def lamp_factors() -> Generator[float, None, LampFactors]:
    """Let Cycles evaluate the nodes of all lamps whose light is not constant, one per step.

    Before the scene is evaluated: rendering would not leave its objects alive.
    """
    factors: LampFactors = {}
    wanted = [
        lamp.name_full for lamp in bpy.data.lights if lamp.users and uses_nodes(lamp) and _needs_cycles(lamp)
    ]
    for number, name in enumerate(wanted):
        yield number / len(wanted)
        lamp = next((each for each in bpy.data.lights if each.name_full == name), None)
        if lamp is not None:
            factors[name] = lamp_factor(lamp)
    return factors


def _needs_cycles(lamp: bpy.types.Light) -> bool:
    with known_means_only(None):
        return bool(read_radiance(lamp, "lamp")[1])


def read_lamp(
    lamp: bpy.types.Object, matrix_world: np.ndarray, factors: LampFactors, dark: bool = False
) -> tuple[Light | None, tuple[BakeWarning, ...]]:
    """Return the light that a lamp object, or an instance of one, is.

    lamp bpy.types.Object of type LIGHT, evaluated.
    matrix_world (4, 4).
    factors: Of `lamp_factors`.
    dark: Whether a lamp without power is a light as well: it may get some later.
    Returns light: None where it gives no light.
    Raises SceneError if its position or power is NaN or infinite.
    """
    data = lamp.data
    name = lamp.name
    if _is_portal(data) or not lamp.visible_diffuse:
        return None, ()
    warnings = _not_understood(lamp)
    strength, notes = _strength(name, data, factors)
    warnings += notes
    if not (all_finite(matrix_world) and np.isfinite(strength).all()):
        raise SceneError(
            f"lamp '{name}' has a NaN or infinite position or power; fix its transform and strength"
        )
    if (strength < 0).any():
        warnings.append(BakeWarning(name, f"lamp '{name}': negative power is not possible; 0 is used"))
        strength = np.maximum(strength, 0.0)
    if not strength.any() and not dark:
        return None, tuple(warnings)
    light, notes = _MAKE[data.type](name, data, matrix_world, strength)
    return light, tuple(warnings + notes)


def _strength(name: str, data: bpy.types.Light, factors: LampFactors) -> tuple[np.ndarray, list[BakeWarning]]:
    """Return energy × color of all that scales it, (3,) RGB [W, or W/m² of a sun]."""
    strength = data.energy * np.array(data.color[:3], dtype=np.float64)
    if getattr(data, "use_temperature", False):
        strength = strength * np.array(data.temperature_color[:3], dtype=np.float64)
    strength = strength * 2.0 ** getattr(data, "exposure", 0.0)
    if not uses_nodes(data):
        return strength, []
    factor, warnings = read_radiance(data, "lamp")
    measured = factors.get(data.original.name_full)
    if not warnings or measured is None:
        return strength * factor, [BakeWarning(name, warning.message) for warning in warnings]
    mean, variation = measured
    notes = []
    if _asks_for_distance(data.node_tree):
        message = "its nodes change its light with distance; their result at 1 m is used"
        notes.append(BakeWarning(name, f"lamp '{name}': {message}"))
    if variation > _EVEN:
        message = "its nodes depend on direction; their mean over all directions is used"
        notes.append(BakeWarning(name, f"lamp '{name}': {message}"))
    return strength * mean, notes


def _point(
    name: str, data: bpy.types.Light, matrix: np.ndarray, strength: np.ndarray
) -> tuple[Light, list[BakeWarning]]:
    # The object's scale does not act on the radius (measured in Cycles 4.2 and 5.0).
    radius = data.shadow_soft_size
    return PointLight(
        matrix[:3, 3],
        strength * _sphere_area(data),
        radius=radius,
        soft_falloff=data.use_soft_falloff,
        casts_shadow=_casts_shadow(data),
        name=name,
    ), []


def _spot(
    name: str, data: bpy.types.Light, matrix: np.ndarray, strength: np.ndarray
) -> tuple[Light, list[BakeWarning]]:
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    stretched = scale.min() > 0 and np.ptp(scale) > _SAME_SCALE * scale.max()
    return SpotLight(
        matrix[:3, 3],
        _backward(matrix),
        strength * _sphere_area(data),
        data.spot_size,
        blend=data.spot_blend,
        radius=data.shadow_soft_size,
        soft_falloff=data.use_soft_falloff,
        # Cycles tests the cone in the lamp's own space, so a scale across it widens it.
        round_from_world=np.linalg.inv(matrix[:3, :3]) if stretched else None,
        casts_shadow=_casts_shadow(data),
        name=name,
    ), []


def _sun(
    name: str, data: bpy.types.Light, matrix: np.ndarray, strength: np.ndarray
) -> tuple[Light, list[BakeWarning]]:
    if not getattr(data, "normalize", True):
        strength = strength * cone_projected_solid_angle(data.angle / 2.0)  # it was a radiance
    return SunLight(
        _backward(matrix), strength, angle=data.angle, casts_shadow=_casts_shadow(data), name=name
    ), []


def _area(
    name: str, data: bpy.types.Light, matrix: np.ndarray, strength: np.ndarray
) -> tuple[Light, list[BakeWarning]]:
    # Power stays the same when the object is scaled, the emitting surface does not.
    size_y = data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else data.size
    edge_u = matrix[:3, 0] * data.size
    edge_v = matrix[:3, 1] * size_y
    if np.cross(edge_u, edge_v) @ _backward(matrix) < 0:
        edge_v = -edge_v  # emits along the object's -Z, mirrored or not
    shape = "ellipse" if data.shape in ("DISK", "ELLIPSE") else "rectangle"
    area = float(np.linalg.norm(np.cross(edge_u, edge_v))) * (math.pi / 4 if shape == "ellipse" else 1.0)
    if area == 0.0:
        raise SceneError(f"lamp '{name}' has no area; give it a size and a scale above 0")
    if not getattr(data, "normalize", True):
        strength = strength * area
    return AreaLight(
        matrix[:3, 3],
        edge_u,
        edge_v,
        strength,
        shape=shape,
        spread=data.spread,
        casts_shadow=_casts_shadow(data),
        name=name,
    ), []


def _backward(matrix: np.ndarray) -> np.ndarray:
    """Return the unit direction a lamp points in: its object's -Z axis."""
    axis = -matrix[:3, 2]
    length = float(np.linalg.norm(axis))
    return axis / length if length > 0 else np.array([0.0, 0.0, -1.0])


def _sphere_area(data: bpy.types.Light) -> float:
    """Return the factor on an unnormalized point or spot lamp's power (measured)."""
    if getattr(data, "normalize", True):
        return 1.0
    return sphere_area(data.shadow_soft_size)


def _casts_shadow(data: bpy.types.Light) -> bool:
    """Return the setting that Cycles uses: its own or, in later versions, that of all engines."""
    return bool(getattr(data.cycles, "cast_shadow", data.use_shadow))


def _is_portal(data: bpy.types.Light) -> bool:
    return data.type == "AREA" and bool(getattr(getattr(data, "cycles", None), "is_portal", False))


def _asks_for_distance(tree: bpy.types.NodeTree) -> bool:
    """Return whether nodes change the falloff of light from the square of the distance."""
    for node in tree.nodes:
        if node.type == "LIGHT_FALLOFF":
            linked = {output.name for output in node.outputs if output.is_linked}
            smooth = node.inputs["Smooth"]
            if linked - {"Quadratic"} or (linked and (smooth.is_linked or smooth.default_value > 0)):
                return True
        if node.type == "GROUP" and node.node_tree is not None and _asks_for_distance(node.node_tree):
            return True
    return asks_light_path(tree, ("Ray Length",))


def _not_understood(lamp: bpy.types.Object) -> list[BakeWarning]:
    data = lamp.data
    messages = []
    if data.type == "SPOT" and data.use_square:
        messages.append("the square cone is ignored; a round one is used")
    cycles = getattr(data.original, "cycles", None)
    if getattr(cycles, "max_bounces", ALL_BOUNCES) < ALL_BOUNCES:
        messages.append("its limit of bounces is ignored: all its light is followed")
    warnings = [BakeWarning(lamp.name, f"lamp '{lamp.name}': {message}") for message in messages]
    return warnings + linking_warnings(lamp, "lamp")


_MAKE = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}
