"""The residual of a solution: closed forms, the identity r = −Kε, and how fast it falls."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics.radiometry import (
    brdf_of_reflectance,
    intensity_of_flux,
    irradiance_from_point,
    radiosity_of_radiance,
    reflected_radiance,
)
from radiosity_addon.solver import EnvironmentLight, PointLight, Scene, Solution, SolverSettings, SpotLight
from radiosity_addon.solver.equations.assembly import collocation, galerkin, linear
from radiosity_addon.solver.equations.fixed_elements import subdivide_evenly
from radiosity_addon.solver.equations.linear_basis import vertex_basis
from radiosity_addon.solver.equations.linear_system import LinearSystem
from radiosity_addon.solver.gather.residual import Residual
from radiosity_addon.solver.hierarchy.basis import Basis, constant_basis
from radiosity_addon.solver.methods.matrix import MatrixState
from radiosity_addon.solver.state.state import begin
from tests.rooms import CEILING, box_room, gray, gray_scene, rectangle, solid_box


def prepared(scene: Scene, elements: int, basis: str = "constant", **settings: int) -> MatrixState:
    """A scene cut into elements whose radiosity is what they emit."""
    state = begin(scene, SolverSettings(**settings), MatrixState)
    subdivide_evenly(state.hierarchy, elements)
    state.reset()
    state.basis = (vertex_basis if basis == "linear" else constant_basis)(state.hierarchy)
    state.values = state.emission[state.basis.leaf[state.basis.home]]
    return state


def assembled(state: MatrixState, assembly: str) -> LinearSystem:
    if assembly == "linear":
        return linear(state.hierarchy, state.caster, state.basis)
    return {"galerkin": galerkin, "collocation": collocation}[assembly](state.hierarchy, state.caster)


def solved(scene: Scene, elements: int, assembly: str) -> MatrixState:
    """The direct solution of a scene that is lit by its surfaces alone."""
    state = prepared(scene, elements, "linear" if assembly == "linear" else "constant")
    system = assembled(state, assembly)
    columns = [np.linalg.solve(system.matrix(k), system.emission[:, k]) for k in range(3)]
    state.values = np.stack(columns, axis=1)
    return state


def nodes(state: MatrixState) -> tuple[np.ndarray, np.ndarray]:
    """The faces of a basis' nodes, and where in the faces' triangles they lie."""
    basis: Basis = state.basis
    face = basis.faces(state.hierarchy)
    corners = state.scene.triangles[state.hierarchy.faces.triangle[face]]
    along = basis.points(state.hierarchy) - corners[:, 0]
    weights = [
        np.linalg.lstsq(c[1:].T - c[:1].T, p, rcond=None)[0] for c, p in zip(corners, along, strict=True)
    ]
    return face, np.array(weights)


def anywhere(state: MatrixState, count: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Random points of random faces, and their barycentric weights."""
    rng = np.random.default_rng(4)
    unit = rng.uniform(size=(count, 2))
    unit = np.where(unit.sum(axis=1, keepdims=True) > 1, 1 - unit, unit)
    return rng.integers(0, len(state.hierarchy.faces), count), unit


def lit_from_above(reflectance: float = 0.5) -> Scene:
    room, surface = box_room()
    emission = gray(12, 0.0)
    emission[surface == CEILING] = (1.0, 0.5, 0.2)
    return gray_scene(room, reflectance, emission)


def with_a_box(reflectance: float = 0.5) -> Scene:
    """The same room with a box in it: much is hidden, wholly or in part."""
    room = lit_from_above()
    triangles = np.concatenate([room.triangles, solid_box((0.2, 0.3, 0.2), (0.6, 0.7, 0.6))])
    emission = np.concatenate([room.emission, gray(12, 0.0)])
    return gray_scene(triangles, reflectance, emission)


def test_the_exact_solution_of_an_enclosure_leaves_nothing() -> None:
    """E = 1 − ρ everywhere in a closed room: B = 1."""
    rho = np.array([0.2, 0.5, 0.9])
    state = prepared(Scene(box_room((2, 1, 1))[0], np.tile(rho, (12, 1)), np.tile(1 - rho, (12, 1))), 50)
    state.values[:] = state.radiosity[:] = 1.0
    residual = Residual(state)
    np.testing.assert_allclose(residual.at(*anywhere(state)), 0, atol=1e-12)
    np.testing.assert_allclose(residual.by_rays(*anywhere(state), rays=64), 0, atol=1e-6)


def test_light_that_was_never_sent_on_is_missing() -> None:
    """B̂ = E in a closed room lacks the first reflection: r = −ρE."""
    rho, emission = np.array([0.2, 0.5, 0.9]), np.array([3.0, 2.0, 1.0])
    state = prepared(Scene(box_room((1, 1, 3))[0], np.tile(rho, (12, 1)), np.tile(emission, (12, 1))), 50)
    expected = np.tile(-rho * emission, (60, 1))
    np.testing.assert_allclose(Residual(state).at(*anywhere(state)), expected, rtol=1e-12)
    np.testing.assert_allclose(Residual(state).by_rays(*anywhere(state), rays=16), expected, rtol=1e-6)


def test_a_dark_plane_lacks_what_a_lamp_reflects_off_it() -> None:
    """Local illumination (2.14 – 2.17): the plane ought to show f (Φ/4π) cosθ/r²; its back nothing."""
    lamp = PointLight((0.3, 0.2, 0.8), (100.0, 50.0, 10.0))
    plane = gray_scene(rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0)), 0.6, two_sided=True, lights=[lamp])
    state = prepared(plane, 16)
    face, weights = anywhere(state)
    residual = Residual(state)
    to_lamp = np.asarray(lamp.position) - residual.position(face, weights)
    distance = np.linalg.norm(to_lamp, axis=1)[:, None]
    arriving = irradiance_from_point(intensity_of_flux(lamp.strength), to_lamp[:, 2:] / distance, distance)
    shown = radiosity_of_radiance(reflected_radiance(brdf_of_reflectance(0.6), arriving))
    front = state.hierarchy.faces.front[face][:, None]
    assert 10 < front.sum() < 50
    for found in (residual.at(face, weights), residual.by_rays(face, weights, 8)):
        np.testing.assert_allclose(found, np.where(front, -shown, 0), rtol=1e-9)


def test_an_open_plane_lacks_what_it_reflects_of_the_sky() -> None:
    """r = −ρπL."""
    lights = [EnvironmentLight((1.0, 2.0, 3.0)), SpotLight((0, 0, -1), (0, 0, -1), 5.0, 1.0)]
    triangles = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    state = prepared(gray_scene(triangles, 0.3, lights=lights), 8)
    expected = np.tile(-0.3 * np.pi * np.array([1.0, 2, 3]), (60, 1))
    np.testing.assert_allclose(Residual(state).at(*anywhere(state)), expected, rtol=1e-12)
    np.testing.assert_allclose(Residual(state).by_rays(*anywhere(state), rays=32), expected, rtol=1e-12)


# Hats are shared out by cubature, whose rule may change with the last bit of a distance.
COLLOCATIONS = pytest.mark.parametrize(("assembly", "rounding"), [("collocation", 1e-12), ("linear", 5e-5)])


@COLLOCATIONS
def test_collocation_leaves_nothing_at_its_nodes(assembly: str, rounding: float) -> None:
    """All of (3.8) vanish, behind obstacles too; between the nodes they do not."""
    state = solved(with_a_box(), 150, assembly)
    residual = Residual(state)
    np.testing.assert_allclose(residual.at(*nodes(state)), 0, atol=rounding)
    assert np.abs(residual.at(*anywhere(state))).max() > 1e-3


@COLLOCATIONS
def test_the_residual_is_the_operator_on_the_error(assembly: str, rounding: float) -> None:
    """r = KB̂ − E = −Kε at the nodes of a collocation, for any B̂ (3.5, 3.6)."""
    state = solved(with_a_box(0.8), 100, assembly)
    system, solution = assembled(state, assembly), state.values
    state.values = np.random.default_rng(2).uniform(0, 3, solution.shape)
    found = Residual(state).at(*nodes(state))
    for channel in range(3):
        error = solution[:, channel] - state.values[:, channel]
        np.testing.assert_allclose(found[:, channel], -system.matrix(channel) @ error, atol=rounding)
    np.testing.assert_allclose(found, -system.residual(state.values), atol=rounding)


def test_each_method_silences_its_own_weights() -> None:
    """(3.7) with delta weights is 0 for collocation, with constant ones for Galerkin; not the other way."""
    point, area = (Residual(solved(lit_from_above(), 48, name)) for name in ("collocation", "galerkin"))
    assert point.norm("delta").max() < 1e-13
    assert area.norm("delta").min() > 1e-3
    # Galerkin's integrals to the error of the quadrature, which falls as it gets finer.
    quadratures = np.array([area.norm("constant", points=points)[0] for points in (1, 2, 3)])
    assert (quadratures[1:] < 0.4 * quadratures[:-1]).all()
    assert quadratures[-1] < 0.05 * point.norm("constant", points=3)[0]
    with pytest.raises(ValueError, match="'cubic'"):
        point.norm("cubic")


def test_galerkin_leaves_no_power_on_any_element() -> None:
    """∫_{A_i} r dA = 0 (3.14): where elements are apart the quadrature is exact enough to see it."""
    floor = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    ceiling = rectangle((0, 0, 1.5), (0, 1, 0), (1, 0, 0))
    emission = gray(4, 0.0)
    emission[2:] = 1.0
    state = solved(gray_scene(np.concatenate([floor, ceiling]), 0.7, emission), 64, "galerkin")
    residual = Residual(state)
    whole, quarters = residual.norm("constant", points=3)[0], residual.norm("constant", splits=1, points=2)[0]
    assert whole < 5e-3 * quarters


@pytest.mark.parametrize("assembly", ["collocation", "galerkin"])
def test_the_residual_falls_with_the_elements_size(assembly: str) -> None:
    """First order for constant elements, a little less: beside edges radiosity is not smooth."""
    norms = [
        Residual(solved(lit_from_above(), n, assembly)).norm(splits=1, points=1)[0] for n in (12, 48, 192)
    ]
    orders = np.log2(np.array(norms[:-1]) / norms[1:])
    assert ((orders > 0.65) & (orders < 1.05)).all()
    assert orders[1] > orders[0]


def test_linear_elements_leave_less_than_constant_ones() -> None:
    constant, linear_ = (Residual(solved(lit_from_above(), 192, name)) for name in ("collocation", "linear"))
    points = anywhere(solved(lit_from_above(), 192, "linear"), 300)
    assert len(linear_.at(*points)) == 300
    assert np.abs(linear_.at(*points)).mean() < 0.5 * np.abs(constant.at(*points)).mean()


def test_rays_find_the_same_residual() -> None:
    state = solved(with_a_box(), 150, "galerkin")
    state.radiosity[state.basis.leaf] = state.values
    residual, points = Residual(state), anywhere(state, 200)
    exact, gathered = residual.at(*points), residual.by_rays(*points, rays=1024)
    assert np.abs(exact).mean() > 0.005
    assert np.abs(gathered - exact).max() < 0.01
    assert abs((gathered - exact).mean()) < 2e-4


def test_a_solution_reports_its_residual_at_either_side() -> None:
    """At triangles' centroids; a side that does not exist has none."""
    state = solved(lit_from_above(), 48, "collocation")
    state.set_leaves(np.zeros_like(state.values), state.values)
    state.light_links = prepared(lit_from_above(), 12).light_links
    solution = Solution(state)
    triangle, weights = np.arange(12), np.full((12, 2), 1 / 3)
    found = solution.residual(triangle, weights)
    np.testing.assert_allclose(found, Residual(state).at(triangle, weights), atol=1e-15)
    np.testing.assert_allclose(solution.residual(triangle, weights, rays=1024), found, atol=0.02)
    with pytest.raises(ValueError, match="triangle 0"):
        solution.residual(triangle, weights, front=False)
