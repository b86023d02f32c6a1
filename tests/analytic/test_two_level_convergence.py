"""The two-level method against the dense solution of its elements, and at shadow edges (handout §4.1)."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from radiosity_addon.solver import Scene, SolverSettings, solve
from radiosity_addon.solver.gather import LocalPass
from radiosity_addon.solver.gather.footprints import Footprints
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from radiosity_addon.solver.methods import solve_by_method
from radiosity_addon.solver.state.state import SolverState
from tests.cornell import cornell_box
from tests.published import (
    CIE_5_8_INDIRECT_LX,
    CUBE_MEANS,
    cie_5_8,
    cie_5_8_indirect,
    shining_cube,
    wall_means,
)
from tests.rooms import box_room, colored_room, gray_scene, rectangle

NEVER = 1e9
"""A contrast no scene has: nothing is split."""


def by(method: str, scene: Scene, elements: int, patches: int = 1, contrast: float = NEVER) -> SolverState:
    settings = SolverSettings(method=method, elements=elements, patches=patches, contrast=contrast)
    return solve_by_method(scene, settings)


def generations(scene: Scene, most: int) -> list[int]:
    """How many elements there are after each generation: the same nodes, whatever comes after."""
    hierarchy = Hierarchy(scene)
    counts = [len(hierarchy.leaves)]
    while counts[-1] <= most:
        area = hierarchy.area[hierarchy.leaves]
        hierarchy.subdivide(hierarchy.leaves[area > 0.5 * area.max()])
        counts.append(len(hierarchy.leaves))
    return counts[:-1]


def distance(one: SolverState, other: SolverState) -> float:
    """Σ A |B − B'| / Φ over the elements, which must be the same, the largest channel."""
    leaves = one.hierarchy.leaves
    assert one.hierarchy.corners.tobytes() == other.hierarchy.corners.tobytes()
    difference = np.abs(one.radiosity[leaves] - other.radiosity[leaves])
    return float((one.hierarchy.area[leaves] @ difference).max()) / one.power


@pytest.mark.parametrize("scene", [cornell_box, colored_room])
def test_one_element_a_patch_is_the_dense_solution(scene: Callable[[], Scene]) -> None:
    dense = by("dense", scene(), 150)
    two = by("two-level", scene(), 150, patches=150)
    for name in ("radiosity", "irradiance"):
        exact, found = getattr(dense, name), getattr(two, name)
        np.testing.assert_allclose(found, exact, rtol=0, atol=1e-10 * exact.max())
    np.testing.assert_allclose(two.closure(), dense.closure(), rtol=0, atol=1e-12)


@pytest.mark.parametrize("scene", [cornell_box, colored_room])
def test_refined_patches_converge_to_the_dense_solution(scene: Callable[[], Scene]) -> None:
    """With the elements fixed, each generation of patches is nearer; the last is the elements."""
    counts = generations(scene(), 260)
    dense = by("dense", scene(), counts[-1])
    errors = [distance(by("two-level", scene(), counts[-1], patches), dense) for patches in counts]
    assert all(finer < coarser for coarser, finer in pairwise(errors))
    # Patches larger than elements are not the elements' own system: the method's limit.
    assert errors[0] > 1e-3
    assert errors[-1] < 1e-12


def shadowed() -> tuple[Scene, np.ndarray]:
    """A floor under a small bright square, a plate between them; and points all over the floor."""
    floor = rectangle((-2, -2, 0), (4, 0, 0), (0, 4, 0))
    plate = rectangle((-0.5, -0.7, 1.0), (0, 1.1, 0), (1.2, 0, 0))
    lamp = rectangle((-0.1, -0.1, 2.0), (0, 0.2, 0), (0.2, 0, 0))
    triangles = np.concatenate([floor, plate, lamp])
    emission = np.repeat([0.0, 0.0, 100.0], 2)[:, None] * np.ones(3)
    along = (np.arange(96) + 0.5) / 96 * 4 - 2
    points = np.stack([*np.meshgrid(along, along), np.zeros((96, 96))], axis=-1).reshape(-1, 3)
    return gray_scene(triangles, 0.5, emission), points


def direct_light(state: SolverState, points: np.ndarray) -> np.ndarray:
    """(p,) H at points of the floor by exact factors and many shadow rays."""
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    return LocalPass.of(state).direct.at(Footprints(points, up, np.arange(len(points))), rays=64)[:, 0]


def at_shadow_edges(truth: np.ndarray) -> np.ndarray:
    """(p,) the tenth of the floor where light changes most."""
    slope = np.hypot(*np.gradient(truth.reshape(96, 96))).ravel()
    return slope > np.quantile(slope, 0.9)


def floor_error(state: SolverState, points: np.ndarray, truth: np.ndarray, where: np.ndarray) -> float:
    """Mean |H of the element − H at the point| over part of the floor, relative to the whole's mean."""
    edges = state.hierarchy.faces.corners[:2]
    error = np.zeros(len(points))
    for face in (0, 1):
        matrix = np.stack([edges[face, 1] - edges[face, 0], edges[face, 2] - edges[face, 0]])[:, :2]
        weights = (points[:, :2] - edges[face, 0, :2]) @ np.linalg.inv(matrix)
        inside = (weights.min(axis=1) >= 0) & (weights.sum(axis=1) <= 1)
        leaf = state.hierarchy.leaf_at(np.full(inside.sum(), face), weights[inside])
        error[inside] = np.abs(state.irradiance[leaf, 0] - truth[inside])
    return float(error[where].mean() / truth.mean())


def test_subdivision_pays_at_shadow_edges() -> None:
    """Splitting where neighbors differ lowers the error there, and more than as many even elements do."""
    scene, points = shadowed()
    plain = by("two-level", scene, 300, patches=20)
    truth = direct_light(plain, points)
    adaptive = by("two-level", scene, 300, patches=20, contrast=0.5)
    even = by("two-level", scene, len(adaptive.hierarchy.leaves), patches=20)
    edge = at_shadow_edges(truth)
    errors = [floor_error(state, points, truth, edge) for state in (plain, even, adaptive)]
    assert errors[2] < 0.5 * errors[0]
    assert errors[2] < 0.65 * errors[1]


def test_less_contrast_is_nearer() -> None:
    scene, points = shadowed()
    truth = direct_light(by("two-level", scene, 120, patches=20), points)
    everywhere = np.ones(len(points), dtype=bool)
    errors = []
    for contrast in (NEVER, 1.0, 0.5, 0.25):
        state = by("two-level", scene, 120, patches=20, contrast=contrast)
        errors.append(floor_error(state, points, truth, everywhere))
    assert all(finer < coarser for coarser, finer in pairwise(errors))
    assert errors[-1] < 0.4 * errors[0]


def test_a_closed_room_of_one_kind_is_exact() -> None:
    """B = E / (1 − ρ) everywhere, whatever the patches: constant sources are exact there."""
    triangles, _ = box_room((1, 2, 0.5))
    scene = gray_scene(triangles, 0.7, 2.0)
    state = by("two-level", scene, 200, patches=12)
    # A patch is right to what its factors' sum is off, times 1 / (1 − ρ).
    np.testing.assert_allclose(state.patch_radiosity, 2.0 / 0.3, rtol=0.01)
    np.testing.assert_allclose(state.radiosity[: len(triangles)], 2.0 / 0.3, rtol=0.01)


def test_cube_with_emitting_ceiling() -> None:
    """Area means of radiosity, ρ = 0.5, against extrapolated Galerkin solutions: nearer with the patches."""
    scene = shining_cube()
    errors = []
    for patches in (12, 48, 192):
        settings = SolverSettings(method="two-level", elements=192, patches=patches, contrast=NEVER)
        solution = solve(scene, settings)
        means = wall_means(solution.triangle_radiosity, scene.areas)[:, 0]
        errors.append(float(np.abs(means / CUBE_MEANS - 1.0).max()))
        power = solution.report["power_W"]
        # With exact factors A_i F_ij = A_j F_ji holds between patches too: no power is lost.
        assert power["absorbed"] == pytest.approx(power["emitted"], rel=1e-4)
    assert errors[2] < 0.003
    # Observed: a quarter of the error for half the size, second order.
    assert errors[0] / errors[1] > 3.5
    assert errors[1] / errors[2] > 3.5


@pytest.mark.parametrize("reflectance", [0.2, 0.5, 0.9])
def test_cie_171_5_8(reflectance: float) -> None:
    scene = cie_5_8(reflectance)
    state = by("two-level", scene, 192, patches=48)
    indirect = cie_5_8_indirect(state.irradiance[:12], scene.areas)
    np.testing.assert_allclose(indirect, CIE_5_8_INDIRECT_LX[reflectance], rtol=0.002)
