"""The hierarchies against the dense system, closed forms, published values, and their own costs."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver import PointLight, Scene, Solution, SolverSettings, solve
from radiosity_addon.solver.equations.exchange import exchange_areas
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from radiosity_addon.solver.methods import hierarchical, multi_level
from radiosity_addon.solver.methods.hierarchical import HierarchicalState
from radiosity_addon.solver.methods.multi_level import MultiLevelState
from tests.published import (
    CIE_5_6_CEILING_PERCENT,
    CIE_5_6_WALL_PERCENT,
    CIE_5_8_INDIRECT_LX,
    CUBE_MEANS,
    CUBE_WITH_EMITTING_CEILING,
    cie_5_6,
    cie_5_8,
    cie_5_8_indirect,
    parallel_plates,
    shining_cube,
    wall_means,
)
from tests.rooms import (
    CEILING,
    FLOOR,
    WALLS,
    box_room,
    gray,
    gray_scene,
    solid_box,
    sphere,
)


def multi_level_settings(form_factor_error: float, min_area: float, **others: float) -> SolverSettings:
    return SolverSettings(
        method="multi-level", form_factor_error=form_factor_error, min_area=min_area, **others
    )


def solved(scene: Scene, form_factor_error: float, min_area: float, **others: float) -> MultiLevelState:
    settings = multi_level_settings(form_factor_error, min_area, **others)
    return multi_level.solve(scene, settings)


def furnished(lights: list | None = None) -> Scene:
    """A closed room of several colors with a box in the air, its ceiling shining."""
    room, surface = box_room((3, 2, 2))
    triangles = np.concatenate([room, solid_box((0.5, 0.5, 0.3), (1.2, 1.2, 1.0))])
    emission = gray(len(triangles), 0.0)
    emission[:12][surface == CEILING] = (1.0, 0.5, 0.25)
    reflectance = np.random.default_rng(5).uniform(0.0, 0.9, (len(triangles), 3))
    return Scene(triangles, reflectance, emission, lights=lights or [])


# --- against the dense system -----------------------------------------------------------------


def test_without_error_it_is_the_dense_solution_on_its_leaves() -> None:
    """F_ε = 0 and a minimum area: all links join finest leaves, (I − ρ F) B = E + ρ H_lamps."""
    lamp = PointLight((2.5, 1.5, 1.5), 20.0)
    for scene in (shining_cube(reflectance=0.8), furnished(), furnished([lamp])):
        state = solved(scene, 0.0, 5e-3, tolerance=1e-13)
        hierarchy, leaves = state.hierarchy, state.hierarchy.leaves
        finest = 5e-3 * hierarchy.faces.area.sum()
        assert (hierarchy.area[leaves] < 4 * finest).all()
        one, other = np.divmod(np.arange(len(leaves) ** 2), len(leaves))
        exchange = exchange_areas(hierarchy, state.caster, leaves[one], leaves[other], seed=0)
        factors = exchange.reshape(len(leaves), -1) / hierarchy.area[leaves][:, None]
        assert len(state.links) == (exchange > 0).sum()
        direct = state.direct()[leaves]
        for channel in range(3):
            reflectance = state.reflectance[leaves, channel]
            emission = state.emission[leaves, channel] + reflectance * direct[:, channel]
            exact = np.linalg.solve(np.eye(len(leaves)) - reflectance[:, None] * factors, emission)
            np.testing.assert_allclose(state.radiosity[leaves, channel], exact, rtol=1e-10, atol=1e-12)
            irradiance = direct[:, channel] + factors @ exact
            np.testing.assert_allclose(state.irradiance[leaves, channel], irradiance, rtol=1e-10)


def test_it_is_what_the_dense_method_finds() -> None:
    """The method of that name, on the same 192 elements."""
    scene = shining_cube()
    ours = solve(scene, multi_level_settings(0.0, 0.9 / 192, tolerance=1e-13))
    dense = solve(scene, SolverSettings(method="dense", elements=192))
    np.testing.assert_allclose(ours.triangle_radiosity, dense.triangle_radiosity, rtol=1e-10)
    np.testing.assert_allclose(ours.triangle_irradiance, dense.triangle_irradiance, rtol=1e-10)


def leaf_points(state: MultiLevelState) -> tuple[np.ndarray, np.ndarray]:
    """Return the faces of the leaves and the barycentric weights of the leaves' centroids in them."""
    hierarchy = state.hierarchy
    face = hierarchy.face[hierarchy.leaves]
    corners = hierarchy.faces.corners[face]
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    arm = hierarchy.corners[hierarchy.leaves].mean(axis=1) - corners[:, 0]
    return face, (np.linalg.pinv(edges) @ arm[..., None])[..., 0]


@pytest.mark.parametrize("scene", [shining_cube(), furnished()], ids=["cube", "furnished"])
def test_error_falls_with_the_form_factor_error(scene: Scene) -> None:
    """∫ |B − B_dense| dA falls faster than F_ε, here below F_ε of the power, and ends at 0."""
    min_area, tolerance = 2.5e-3, 1e-12
    exact = solved(scene, 0.0, min_area, tolerance=tolerance)
    leaves, area = exact.hierarchy.leaves, exact.hierarchy.area[exact.hierarchy.leaves]
    points = leaf_points(exact)
    limits = 0.3 / 2.0 ** np.arange(6)
    errors = np.zeros(len(limits))
    for row, limit in enumerate(limits):
        state = solved(scene, limit, min_area, tolerance=tolerance)
        radiosity = state.radiosity[state.hierarchy.leaf_at(*points)]
        errors[row] = (area @ np.abs(radiosity - exact.radiosity[leaves])).max() / exact.power
    assert (errors < limits).all()
    left = errors > 0
    assert left.sum() >= 5
    assert np.polyfit(np.log(limits[left]), np.log(errors[left]), 1)[0] > 1.0
    # Below what the finest pairs exchange, nothing is coarse any more.
    state = solved(scene, 1e-6, min_area, tolerance=tolerance)
    assert len(state.links) == len(exact.links)
    np.testing.assert_array_equal(state.radiosity[state.hierarchy.leaves], exact.radiosity[leaves])


def test_error_falls_with_the_area_of_the_elements() -> None:
    """With F_ε = 0 the cube's means approach the exact ones as the elements' size, or faster."""
    errors = []
    for level in range(3):
        state = solved(shining_cube(), 0.0, 0.9 / (12 * 4**level))
        assert len(state.hierarchy.leaves) == 12 * 4**level
        errors.append(abs(state.radiosity[:2, 0].mean() - CUBE_WITH_EMITTING_CEILING[FLOOR]))
    assert errors[-1] < 0.005 * CUBE_WITH_EMITTING_CEILING[FLOOR]
    order = -np.polyfit(np.arange(3) * np.log(2), np.log(errors), 1)[0]
    assert order > 1.0


# --- costs ------------------------------------------------------------------------------------


def growth(elements: list[int], links: list[int]) -> float:
    """Return the exponent p of links ~ elements^p."""
    return float(np.polyfit(np.log(elements), np.log(links), 1)[0])


@pytest.mark.parametrize("scene", [shining_cube(), furnished()], ids=["cube", "furnished"])
def test_links_of_the_multi_level_hierarchy_grow_like_its_elements(scene: Scene) -> None:
    """As F_ε falls, with A_ε out of its way: a few links an element, where a matrix has n."""
    elements, links = [], []
    for limit in (0.3, 0.1, 0.03, 0.01, 0.003):
        refinement = solved(scene, limit, 1e-7, max_iterations=1)
        elements.append(len(refinement.hierarchy.leaves))
        links.append(len(refinement.links))
    assert elements[-1] > 50 * elements[0]
    assert growth(elements, links) <= 1.15
    assert max(np.array(links) / elements) < 10
    assert links[-1] < 0.001 * elements[-1] ** 2


def test_links_at_a_fixed_finest_level_are_the_matrix() -> None:
    """With F_ε = 0 there is nothing to gain: n² links between faces that see each other."""
    elements, links = [], []
    for level in range(3):
        state = solved(shining_cube(), 0.0, 0.9 / (12 * 4**level), max_iterations=1)
        elements.append(len(state.hierarchy.leaves))
        links.append(len(state.links))
    assert growth(elements, links) == pytest.approx(2.0, abs=0.01)
    assert links[-1] == round(elements[-1] ** 2 * 5 / 6)


def refined(scene: Scene, error: float) -> HierarchicalState:
    return hierarchical.solve(scene, SolverSettings(error=error, min_area=1e-7))


def test_links_of_the_refined_hierarchy_grow_like_its_elements() -> None:
    """At one BF_ε, as the scene itself is made of more and more triangles: clusters see to that."""
    elements, links, floors = [], [], []
    for n in (6, 8, 10, 13):
        state = refined(shining_cube(n), 1e-2)
        elements.append(len(state.hierarchy.leaves))
        links.append(len(state.links))
        floors.append(state.radiosity[: 2 * n * n, 0].mean())
    assert growth(elements, links) <= 1.15
    np.testing.assert_allclose(floors, CUBE_WITH_EMITTING_CEILING[FLOOR], rtol=0.015)


def test_links_of_the_refined_hierarchy_as_the_error_falls() -> None:
    """More elements and a smaller error together: more than n links, and far from n²."""
    states = [refined(furnished(), error) for error in (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)]
    elements = [len(state.hierarchy.leaves) for state in states]
    links = [len(state.links) for state in states]
    assert (np.diff(elements) > 0).all()
    assert growth(elements, links) < 1.5
    assert links[-1] < 0.02 * elements[-1] ** 2


# --- closed forms and published values --------------------------------------------------------

SETTINGS = {"receivers only": (0.02, 2e-5), "all levels": (0.004, 2e-3), "finest": (0.0, 4e-3)}
"""F_ε and A_ε by what they make of the tree: whole faces send; both sides are refined; a matrix."""


def assert_closed(scene: Scene, solution: Solution, power: float) -> None:
    """All that leaves a side arrives, ΣFV = 1 as an area mean; nothing escapes, what shines is absorbed."""
    np.testing.assert_allclose(solution.triangle_closure, 1.0, atol=2e-5)
    assert solution.report["closure_area_mean"] == pytest.approx(1.0, abs=1e-5)
    watts = solution.report["power_W"]
    assert watts["escaped"] == pytest.approx(0.0, abs=1e-4 * watts["emitted"])
    assert watts["absorbed"] == pytest.approx(watts["emitted"], rel=power)


@cache
def enclosure(shape: str) -> np.ndarray:
    return {"cube": box_room()[0], "grid": box_room((1, 2, 0.5), 2)[0], "sphere": sphere(1)}[shape]


@pytest.mark.parametrize("settings", SETTINGS)
@pytest.mark.parametrize("reflectance", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("shape", ["cube", "grid", "sphere"])
def test_uniform_enclosure(shape: str, reflectance: float, settings: str) -> None:
    """Every surface emits E and reflects ρ: B = E / (1 − ρ) everywhere."""
    triangles = enclosure(shape)
    scene = gray_scene(triangles, reflectance, 2.0)
    solution = solve(scene, multi_level_settings(*SETTINGS[settings]))
    assert_closed(scene, solution, power=0.003)
    np.testing.assert_allclose(solution.triangle_radiosity, 2.0 / (1.0 - reflectance), rtol=0.006)


@pytest.mark.parametrize(
    ("settings", "rtol"), [((0.02, 2e-5), 0.04), ((0.002, 1e-3), 0.005), ((0.0, 1e-3), 0.005)]
)
def test_cube_with_emitting_ceiling(settings: tuple[float, float], rtol: float) -> None:
    """Area means of radiosity, ρ = 0.5: as good as one radiosity a sending face, or as the elements."""
    scene = shining_cube()
    solution = solve(scene, multi_level_settings(*settings))
    assert_closed(scene, solution, power=0.001)
    means = wall_means(solution.triangle_radiosity, scene.areas)[:, 0]
    np.testing.assert_allclose(means, CUBE_MEANS, rtol=rtol)
    assert means.sum() == pytest.approx(2.0, rel=1e-3)


def test_parallel_plates() -> None:
    solution = solve(parallel_plates(), multi_level_settings(0.01, 1e-3))
    np.testing.assert_allclose(solution.triangle_radiosity[:2], 4 / 3, rtol=0.002)
    np.testing.assert_allclose(solution.triangle_radiosity[2:], 2 / 3, rtol=0.002)


@pytest.mark.parametrize("reflectance", CIE_5_8_INDIRECT_LX)
def test_cie_171_5_8(reflectance: float) -> None:
    scene = cie_5_8(reflectance)
    solution = solve(scene, multi_level_settings(0.01, 2e-5))
    assert_closed(scene, solution, power=0.001)
    indirect = cie_5_8_indirect(solution.triangle_irradiance, scene.areas)
    np.testing.assert_allclose(indirect, CIE_5_8_INDIRECT_LX[reflectance], rtol=0.002)


def test_cie_171_5_6() -> None:
    """Illuminance at points."""
    solution = solve(cie_5_6(), multi_level_settings(0.003, 2e-5))
    on_wall = np.array([[2.0, 0.0, z] for z in CIE_5_6_WALL_PERCENT])
    irradiance = solution.irradiance(on_wall, np.tile([0.0, 1.0, 0.0], (len(on_wall), 1)))
    np.testing.assert_allclose(irradiance[:, 0], list(CIE_5_6_WALL_PERCENT.values()), rtol=2e-4)
    on_ceiling = np.array([[2.0, y, 3.0] for y in CIE_5_6_CEILING_PERCENT])
    irradiance = solution.irradiance(on_ceiling, np.tile([0.0, 0.0, -1.0], (len(on_ceiling), 1)))
    # The standard prints four digits.
    np.testing.assert_allclose(irradiance[:, 0], list(CIE_5_6_CEILING_PERCENT.values()), rtol=5e-4)


def test_black_walls_gather_the_exact_factors() -> None:
    """In the room of CIE 5.6 a surface's mean illuminance is its factor to the floor (Howell C-11, C-14)."""
    triangles, surface = box_room((1, 1, 1))
    emission = gray(12, 1.0) * (surface == FLOOR)[:, None]
    solution = solve(gray_scene(triangles, 0.0, emission), multi_level_settings(0.02, 2e-5))
    for number, factor in ((CEILING, 0.1998248957), (WALLS, 0.2000437761)):
        mean = solution.triangle_irradiance[surface == number].mean()
        assert mean == pytest.approx(factor, rel=1e-4)


def test_power_and_closure_of_a_furnished_room() -> None:
    """Where things hide each other, as exactly as a few rays a link can see."""
    scene = furnished()
    for form_factor_error, limit in ((0.01, 0.006), (0.0, 0.002)):
        solution = solve(scene, multi_level_settings(form_factor_error, 2e-3))
        assert solution.report["closure_area_mean"] == pytest.approx(1.0, abs=limit)
        watts = solution.report["power_W"]
        assert watts["absorbed"] == pytest.approx(watts["emitted"], rel=limit)
        assert watts["escaped"] == 0.0


def test_an_open_room_loses_what_leaves_it() -> None:
    """Without its ceiling, the floor shining: F through the opening is 0.19982 (Howell C-11)."""
    triangles, surface = box_room()
    kept = surface != CEILING
    emission = gray(12, 1.0) * (surface == FLOOR)[:, None]
    scene = gray_scene(triangles[kept], 0.0, emission[kept])
    solution = solve(scene, multi_level_settings(0.01, 2e-5))
    np.testing.assert_allclose(solution.triangle_closure[:2], 1 - 0.1998248957, atol=1e-4)
    watts = solution.report["power_W"]
    assert watts["escaped"] == pytest.approx(0.1998248957, abs=2e-3)
    assert watts["absorbed"] + watts["escaped"] == pytest.approx(watts["emitted"], abs=2e-3)


def test_finest_links_are_those_between_the_finest_elements() -> None:
    """The leaves of F_ε = 0 are those of splitting every leaf above the smallest area, in any order."""
    scene = furnished()
    state = solved(scene, 0.0, 5e-3)
    plain = Hierarchy(scene)
    above = 4 * 5e-3 * float(plain.faces.area.sum()) * (1 - 1e-6)
    while len(large := plain.leaves[plain.area[plain.leaves] > above]):
        plain.subdivide(large)

    def keys(hierarchy: Hierarchy) -> list[tuple[float, ...]]:
        return sorted(map(tuple, hierarchy.corners[hierarchy.leaves].reshape(-1, 9).round(9).tolist()))

    assert keys(state.hierarchy) == keys(plain)
    assert EmbreeCaster(scene.triangles).surface_offset == state.caster.surface_offset
