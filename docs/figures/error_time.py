"""Error against time of all methods in the Cornell box, against a much finer reference."""

from __future__ import annotations

import time
from itertools import pairwise
from typing import Any

import drawing
import numpy as np
import scenes
from matplotlib.figure import Figure
from measures import solved

from radiosity_addon.solver import Scene, SolverSettings, SolverState, solve

STEPS: dict[str, list[dict[str, Any]]] = {
    "dense": [{"elements": n} for n in (100, 300, 900)],
    "jacobi": [{"elements": n} for n in (100, 300, 900)],
    "gauss-seidel": [{"elements": n} for n in (100, 300, 900)],
    "conjugate-gradient": [{"elements": n} for n in (100, 300, 900)],
    "shooting": [{"elements": n, "tolerance": 0.02} for n in (100, 200, 400)],
    "two-level": [{"elements": n, "patches": n // 6, "contrast": 1e9} for n in (200, 600, 1800)],
    "multi-level": [{"form_factor_error": f, "min_area": f / 100} for f in (0.1, 0.03, 0.01)],
    "hierarchical": [{"error": e} for e in (1e-2, 1e-3, 1e-4, 1e-5)],
}

WALLS = 10
"""The first triangles of the scene."""

GRID = 4
"""Each wall's triangle is compared on 4^GRID parts, about, as texels would be."""


def figure(small: bool) -> Figure:
    """Solve at growing cost by every method; the error is that of the walls' irradiance."""
    scene = scenes.cornell_box()
    reference = pointwise(scene, 1e-4 if small else 1e-5)
    drawn, (panel,) = drawing.axes(1, 6.4, 3.8)
    best = {}
    for number, (method, steps) in enumerate(STEPS.items()):
        points = []
        for step in steps[:2] if small else steps:
            start = time.perf_counter()
            state = solved(scene, method=method, **step)
            points.append((time.perf_counter() - start, error(on_grid(state), reference)))
        seconds, errors = np.array(points).T
        # Whoever pays more gets more; times are not asserted.
        assert all(finer < 1.05 * coarser for coarser, finer in pairwise(errors)), (method, errors)
        best[method] = errors[-1]
        style = "-" if method in ("hierarchical", "multi-level", "two-level") else "--"
        panel.loglog(seconds, errors, "osv^DPX*"[number] + style, label=method, color=drawing.CYCLE[number])
    direct = [best[name] for name in ("dense", "jacobi", "gauss-seidel", "conjugate-gradient")]
    np.testing.assert_allclose(direct, direct[0], rtol=0.01)  # one system, one solution
    assert min(best, key=lambda name: best[name]) == "hierarchical" or small
    panel.set(xlabel=f"seconds ({drawing.machine()})", ylabel="relative error of the walls' irradiance")
    panel.legend(fontsize=7, loc="lower left", ncols=2)
    return drawn


def pointwise(scene: Scene, threshold: float) -> np.ndarray:
    """Return (k, 3) the reference: irradiance at the grid's points by shadow and gather rays."""
    solution = solve(scene, SolverSettings(error=threshold))
    triangle, weights = grid()
    corners = scene.triangles[triangle]
    points = corners[:, 0] + np.einsum("nc,nck->nk", weights, corners[:, 1:] - corners[:, :1])
    return np.asarray(solution.irradiance(points, scene.face_normals[triangle]))


def grid() -> tuple[np.ndarray, np.ndarray]:
    """Return (k,) triangle and (k, 2) barycentric of the centroids of equal parts of the walls."""
    side = 2**GRID
    i, j = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    inside = i + j < side
    weights = (np.stack([i[inside], j[inside]], axis=1) + 1 / 3) / side
    return np.repeat(np.arange(WALLS), len(weights)), np.tile(weights, (WALLS, 1))


def on_grid(state: SolverState) -> np.ndarray:
    """Return (k, 3) the irradiance of the elements under the grid's points."""
    triangle, weights = grid()
    leaf = state.hierarchy.leaf_at(state.hierarchy.faces.of_triangle[0, triangle], weights)
    return np.asarray(state.irradiance[leaf])


def error(values: np.ndarray, reference: np.ndarray) -> float:
    """Return the difference in quadratic mean, relative to the reference's mean."""
    return float(np.sqrt(((values - reference) ** 2).mean()) / reference.mean())
