"""A closed room with a block in it, of any number of triangles: how cost grows. No Blender is needed."""

from __future__ import annotations

from typing import Any

import numpy as np

from radiosity_addon.bake.quality import quality_of
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeObject, BakeScene
from radiosity_addon.solver import Scene, solve
from tests.rooms import box_room

from .recording import Stopwatch, solver_figures, watched_bake

SIZE, BLOCK_SIZE, BLOCK_AT = (5.0, 4.0, 3.0), (1.2, 1.0, 0.9), (1.3, 1.5, 0.4)
POWER = 400.0
"""Of the lamp, the middle of the ceiling [W], in each channel."""

CEILING = 1
COLORS = np.array(
    [(0.4, 0.3, 0.2), (0.8, 0.8, 0.8), (0.7, 0.2, 0.1), (0.2, 0.5, 0.2), *[(0.7, 0.7, 0.7)] * 8]
)
"""Reflectances of the room's six sides and the block's."""


def room(triangles: int) -> tuple[Scene, np.ndarray]:
    """Return a room of about so many triangles of like size, and (t, 3, 2) UVs on one page."""
    n = max(1, round(np.sqrt(0.9 * triangles / 12)))
    m = max(1, round(np.sqrt(max(triangles / 12 - n * n, 1))))
    outer, outer_side = box_room(SIZE, n)
    inner, inner_side = box_room(BLOCK_SIZE, m)
    inner = inner[:, [0, 2, 1]] + BLOCK_AT
    corners = np.concatenate([outer, inner])
    side = np.concatenate([outer_side, 6 + inner_side])
    middle = np.abs(corners.mean(axis=1)[:, :2] / SIZE[:2] - 0.5).max(axis=1) < 0.17
    lamp = (side == CEILING) & middle
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    emission = lamp[:, None] * np.full(3, POWER / area[lamp].sum())
    scene = Scene(corners, COLORS[side], emission)
    return scene, _uv(corners, side)


def _uv(corners: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Put each side into its own cell of a 4 × 3 grid, straight on."""
    uv = np.zeros((len(corners), 3, 2), dtype=np.float32)
    for number in range(12):
        of = side == number
        spans = np.ptp(corners[of].reshape(-1, 3), axis=0)
        axes = np.flatnonzero(spans > 1e-9)
        flat = (corners[of][..., axes] - corners[of].reshape(-1, 3).min(axis=0)[axes]) / spans[axes]
        one, two = (flat[0, corner] - flat[0, 0] for corner in (1, 2))
        if one[0] * two[1] < one[1] * two[0]:
            flat[..., 0] = 1 - flat[..., 0]  # the front is counter-clockwise on the page too
        uv[of] = (np.array(divmod(number, 3)) + 0.02 + 0.96 * flat) / (4, 3)
    return uv


def solve_room(triangles: int, settings: BakeSettings) -> dict[str, Any]:
    """Solve, without a lightmap."""
    scene, _ = room(triangles)
    watch = Stopwatch()
    with watch.running():
        solution = solve(scene, quality_of(settings).solver)
        report = solution.report
    leaves = len(solution.local_pass.elements.hierarchy.leaves)
    return {"triangles": len(scene), **watch.figures, **solver_figures(report, leaves)}


def bake_room(triangles: int, settings: BakeSettings) -> dict[str, Any]:
    """Bake one page whose UVs are there."""
    scene, uv = room(triangles)
    count = len(scene)
    corners = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    item = BakeObject("Room", 0, count, True, np.arange(count, dtype=np.int32), corners, uv)
    watch = Stopwatch()
    with watch.running():
        result, leaves = watched_bake(BakeScene(scene, (item,)), settings)
    texels = int(result.pages[0].coverage.sum())
    figures = {**watch.figures, **solver_figures(result.solver, leaves), "stages": result.seconds}
    return {"triangles": count, "texels": texels, **figures}
