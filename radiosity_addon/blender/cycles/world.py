"""The world as lights: a constant sky, or what Cycles shows of any node tree, by direction."""

from __future__ import annotations

from collections.abc import Generator

import bpy
import numpy as np

from ...base import BakeWarning, SceneError
from ...lights import (
    Bounds,
    EnvironmentLight,
    Light,
    SkyPatch,
    bright_patches,
    even_part,
    pixel_bounds,
    solid_angles,
)
from ..datablocks.image_values import known_means_only
from ..materials.materials import read_radiance, uses_nodes
from .lamps import ALL_BOUNCES
from .world_pixels import camera_pixels, world_pixels

_CORE = 0.05
"""The core of a patch is what is above this fraction of its brightest pixel: a sun without its glow."""

_SMALL = np.radians(10.0)
"""A core that spans less is looked at closely: it may be a sun, which the first look hits by few samples."""

_WORTH = 0.01
"""Of the sky's light: a core with less is not worth a look, which takes Blender up to a second."""

_CLOSE = (96, 96)
"""Pixels of that look."""


WorldLights = tuple[list[Light], tuple[BakeWarning, ...]]


def read_world(world: bpy.types.World | None, dark: bool = False) -> Generator[float, None, WorldLights]:
    """Return the lights that a world is; none where it is black or there is none.

    Each time that Cycles renders it is a step; the world is found by its name again after each.

    world: As the file has it, not evaluated: it may be rendered.
    dark: Whether a black one is a light as well: it may shine later.
    Raises BakeError if its nodes vary with direction, and Cycles could not render them.
    """
    if world is None or not _lights_surfaces(world):
        return [], ()
    limited = _limited(world)
    if not uses_nodes(world):
        return _constant(np.array(world.color[:3], dtype=np.float64), world.name, dark), limited
    with known_means_only(None):  # an image is not constant
        radiance, warnings = read_radiance(world, "world")
    # The walk through the nodes warns of values that are not constant; Cycles evaluates those.
    other_warnings = tuple(warning for warning in warnings if "volume" in warning.message)
    if len(other_warnings) == len(warnings):
        return _constant(radiance, world.name, dark), other_warnings + limited
    return (yield from _sampled(world.name_full)), other_warnings + limited


def seen_background(world: bpy.types.World | None) -> np.ndarray:
    """Return the radiance that cameras see behind all objects (h, w, 3) [W/m²/sr], as `world_pixels`.

    Raises BakeError if Cycles could not render it.
    """
    if world is None:
        return np.zeros((1, 2, 3))
    if not uses_nodes(world):
        radiance = np.array(world.color[:3], dtype=np.float64)
    else:
        with known_means_only(None):
            radiance, warnings = read_radiance(world, "world")
        if any("volume" not in warning.message for warning in warnings):
            return camera_pixels(world)
    return np.broadcast_to(radiance, (1, 2, 3))


def _constant(radiance: np.ndarray, name: str, dark: bool) -> list[Light]:
    return [EnvironmentLight(radiance, name=name)] if radiance.any() or dark else []


def _lights_surfaces(world: bpy.types.World) -> bool:
    visibility = getattr(world, "cycles_visibility", None)
    return bool(getattr(visibility, "diffuse", True))


def _limited(world: bpy.types.World) -> tuple[BakeWarning, ...]:
    if getattr(getattr(world, "cycles", None), "max_bounces", ALL_BOUNCES) >= ALL_BOUNCES:
        return ()
    message = f"world '{world.name}': its limit of bounces is ignored: all its light is followed"
    return (BakeWarning(world.name, message),)


def _named(name: str) -> bpy.types.World:
    """Return the world of a full name.

    Raises SceneError if it was removed between two steps.
    """
    world = next((each for each in bpy.data.worlds if each.name_full == name), None)
    if world is None:
        raise SceneError(f"world '{name}' was removed or renamed while the scene was read: bake again")
    return world


def _sampled(full_name: str) -> Generator[float, None, list[Light]]:
    """Render a world and split it into an even part and bright patches."""
    yield 0.0
    name = _named(full_name).name
    pixels = world_pixels(_named(full_name))
    yield 0.5
    excess, patches = bright_patches(pixels)
    even = pixels - excess.reshape(pixels.shape)
    lights: list[Light] = list(even_part(even, name))
    for number, rows in enumerate(patches):
        yield 0.5 + 0.5 * number / len(patches)
        lights.append(_patch(_named(full_name), pixels, excess, rows))
    return [light for light in lights if light.strength.any()]


def _patch(world: bpy.types.World, pixels: np.ndarray, excess: np.ndarray, rows: np.ndarray) -> SkyPatch:
    """Return the excess of some pixels as a light; its core is looked at closely if it is small."""
    bounds = pixel_bounds((pixels.shape[0], pixels.shape[1]))
    angle = solid_angles(bounds)
    flat = pixels.reshape(-1, 3)
    brightness = excess[rows].mean(axis=1)
    core = rows[brightness > _CORE * brightness.max()]
    power = excess * angle[:, None]
    window = _around(bounds[core], margin=np.pi / len(pixels))
    if window is not None and power[core].sum() > _WORTH * (flat * angle[:, None]).sum():
        # What is not the patch's there stays in the even part of the sky, or in another patch.
        kept = flat.copy()
        kept[rows] -= excess[rows]
        inside = _inside(bounds, window)
        close = pixel_bounds(_CLOSE, window)
        radiance = world_pixels(world, window, _CLOSE).reshape(-1, 3)
        total = (radiance * solid_angles(close)[:, None]).sum(axis=0)
        of_core = np.maximum(total - (kept[inside] * angle[inside, None]).sum(axis=0), 0.0)
        above = radiance.mean(axis=1) - kept[rows].mean(axis=1).max()
        share = np.maximum(above, 0.0) * solid_angles(close)
        if of_core.any() and share.any():
            share *= of_core.mean() / share.sum()
            rest = rows[~inside[rows]]
            return SkyPatch(
                of_core + power[rest].sum(axis=0),
                np.concatenate([close[share > 0.0], bounds[rest]]),
                np.concatenate([share[share > 0.0], power[rest].mean(axis=1)]),
                name=world.name,
            )
    return SkyPatch(power[rows].sum(axis=0), bounds[rows], power[rows].mean(axis=1), name=world.name)


def _around(bounds: np.ndarray, margin: float) -> Bounds | None:
    """Return the window around pixels, and so much around them [rad]; None if it is not small."""
    left, right = bounds[:, 2], bounds[:, 3]
    if right.max() - left.min() > np.pi:  # they lie on both sides of where azimuths jump
        left, right = (np.where(side < 0, side + 2.0 * np.pi, side) for side in (left, right))
        right = np.where(right < left, right + 2.0 * np.pi, right)
    low = max(float(bounds[:, 0].min()) - margin, -0.5 * np.pi)
    high = min(float(bounds[:, 1].max()) + margin, 0.5 * np.pi)
    start, end = float(left.min()) - margin, float(right.max()) + margin
    wide = (end - start) * np.cos(0.5 * (low + high))
    small = high - low < _SMALL and wide < _SMALL and end - start < np.pi
    return (low, high, start, end) if small else None


def _inside(bounds: np.ndarray, window: Bounds) -> np.ndarray:
    """Return (n,) whether pixels lie in a window that ends where pixels do."""
    latitude = 0.5 * (bounds[:, 0] + bounds[:, 1])
    azimuth = 0.5 * (bounds[:, 2] + bounds[:, 3])
    turned = np.mod(azimuth - window[2], 2.0 * np.pi)
    return (latitude > window[0]) & (latitude < window[1]) & (turned < window[3] - window[2])
