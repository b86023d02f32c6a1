"""Scenes with images on their surfaces, for tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from radiosity_addon.scene.textures import SurfaceImages
from radiosity_addon.solver import Scene
from tests.rooms import box_room, gray_scene, rectangle
from tests.unit.texel_scenes import QUAD_UV


def image(
    size: int, reflectance: Any = 0.0, emission: Any = 0.0, opacity: Any = 1.0, wide: int | None = None
) -> np.ndarray:
    """Return (size, wide or size, 7) texels of constants or of arrays that broadcast to them."""
    shape = (size, wide or size)
    values = np.empty((*shape, 7))
    for channels, given in ((slice(0, 3), reflectance), (slice(3, 6), emission), (slice(6, 7), opacity)):
        given = np.asarray(given, dtype=float)
        values[..., channels] = given[..., None] if given.ndim == 2 else given
    return values


def patterned(size: int = 32, seed: int = 0) -> np.ndarray:
    """Return (size, size, 3) reflectances: blocks from black to 0.95, and noise over them."""
    chance = np.random.default_rng(seed)
    blocks = chance.random((4, 4, 3)).repeat(size // 4, axis=0).repeat(size // 4, axis=1)
    return np.asarray(0.95 * np.clip(blocks * chance.random((size, size, 3)) ** 0.3, 0, 1))


def furnace(level: float = 3.0, opacity: Any = None, seed: int = 0) -> Scene:
    """A closed room of textured walls with E = (1 − ρ) c: whatever ρ is, B = c everywhere.

    With an opacity, a two-sided screen of it stands in the middle.
    """
    room, _ = box_room((2, 1, 1))
    reflectance = patterned(seed=seed)
    values = image(32, reflectance, (1 - reflectance) * level)
    uv = np.tile(QUAD_UV, (6, 1, 1))
    if opacity is None:
        count = len(room)
        return gray_scene(room, 0, images=SurfaceImages(values, uv, np.ones(count, bool)))
    triangles = np.concatenate([room, rectangle((1, 0, 0), (0, 1, 0), (0, 0, 1))])
    count = len(triangles)
    # The walls take the left half of the image, the screen the right one.
    both = np.concatenate([values, values], axis=1)
    both[:, 32:, 6] = opacity
    inset = np.array([30 / 64, 1.0]), np.array([33 / 64, 0.0])
    uv = np.concatenate([uv * inset[0], QUAD_UV * inset[0] + inset[1]])
    two_sided = np.arange(count) >= len(room)
    return gray_scene(triangles, 0, two_sided=two_sided, images=SurfaceImages(both, uv, np.ones(count, bool)))
