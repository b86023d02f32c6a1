"""The hierarchical solver against closed forms, published values and conservation."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver import (
    AreaLight,
    EnvironmentLight,
    PointLight,
    Scene,
    SolverSettings,
    SunLight,
    solve,
)
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
    area_mean,
    box_room,
    gray_scene,
    rectangle,
    solid_box,
    sphere,
)
from tests.unit.solved_rooms import furnished


def assert_closed(scene: Scene, solution, overall: float = 0.002) -> None:
    """All that leaves surfaces of a closed scene arrives: ΣFV = 1 over all, emitted = absorbed."""
    closure = solution.triangle_closure
    assert float(scene.areas @ closure / scene.areas.sum()) == pytest.approx(1.0, abs=overall)
    assert solution.report["closure_area_mean"] == pytest.approx(1.0, abs=overall)
    power = solution.report["power_W"]
    assert power["absorbed"] + power["escaped"] == pytest.approx(power["emitted"], rel=overall)
    assert power["escaped"] == pytest.approx(0.0, abs=1e-4 * power["emitted"])


@pytest.mark.parametrize("reflectance", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("shape", ["cube", "grid", "sphere", "tetrahedron"])
def test_uniform_enclosure(shape: str, reflectance: float) -> None:
    """Every surface emits E and reflects ρ: B = E / (1 − ρ) everywhere."""
    triangles = {
        "cube": box_room()[0],
        "grid": box_room((1, 2, 0.5), 5)[0],
        "sphere": sphere(3),
        "tetrahedron": np.array(
            [[[1, 1, 1], [1, -1, -1], [-1, 1, -1]], [[1, 1, 1], [-1, 1, -1], [-1, -1, 1]],
             [[1, 1, 1], [-1, -1, 1], [1, -1, -1]], [[1, -1, -1], [-1, -1, 1], [-1, 1, -1]]], dtype=float
        )[:, ::-1],
    }[shape]  # fmt: skip
    scene = gray_scene(triangles, reflectance, 2.0)
    solution = solve(scene)
    assert_closed(scene, solution)
    np.testing.assert_allclose(solution.triangle_radiosity, 2.0 / (1.0 - reflectance), rtol=0.02)
    mean = area_mean(solution.triangle_radiosity, scene.areas)
    np.testing.assert_allclose(mean, 2.0 / (1.0 - reflectance), rtol=0.005)


@pytest.mark.parametrize("n", [1, 6])
def test_cube_with_emitting_ceiling(n: int) -> None:
    """Area means of radiosity, ρ = 0.5, against exact Galerkin solutions."""
    scene = shining_cube(n)
    solution = solve(scene)
    assert_closed(scene, solution)
    means = wall_means(solution.triangle_radiosity, scene.areas)
    np.testing.assert_allclose(means, np.tile(CUBE_MEANS, (3, 1)).T, rtol=0.006)
    assert means[:, 0].sum() == pytest.approx(2.0, rel=0.003)


def test_error_falls_with_the_threshold() -> None:
    """A hundredth of BF_ε brings the means several times nearer to the exact solution."""
    scene = shining_cube()
    errors = []
    for error in (1e-2, 1e-4):
        solution = solve(scene, SolverSettings(error=error))
        means = wall_means(solution.triangle_radiosity, scene.areas)[:, 0]
        errors.append(np.abs(means - CUBE_MEANS).max())
    assert errors[1] < 0.4 * errors[0]


def test_parallel_plates() -> None:
    solution = solve(parallel_plates())
    np.testing.assert_allclose(solution.triangle_radiosity[:2], 4 / 3, rtol=0.005)
    np.testing.assert_allclose(solution.triangle_radiosity[2:], 2 / 3, rtol=0.005)


@pytest.mark.parametrize("reflectance", CIE_5_8_INDIRECT_LX)
def test_cie_171_5_8(reflectance: float) -> None:
    scene = cie_5_8(reflectance)
    solution = solve(scene)
    assert_closed(scene, solution)
    indirect = cie_5_8_indirect(solution.triangle_irradiance, scene.areas)
    np.testing.assert_allclose(indirect, CIE_5_8_INDIRECT_LX[reflectance], rtol=0.01)


def test_cie_171_5_6() -> None:
    """Illuminance at points."""
    solution = solve(cie_5_6())
    on_wall = np.array([[2.0, 0.0, z] for z in CIE_5_6_WALL_PERCENT])
    irradiance = solution.irradiance(on_wall, np.tile([0.0, 1.0, 0.0], (len(on_wall), 1)))
    np.testing.assert_allclose(irradiance[:, 0], list(CIE_5_6_WALL_PERCENT.values()), rtol=2e-4)
    on_ceiling = np.array([[2.0, y, 3.0] for y in CIE_5_6_CEILING_PERCENT])
    irradiance = solution.irradiance(on_ceiling, np.tile([0.0, 0.0, -1.0], (len(on_ceiling), 1)))
    # The standard prints four digits.
    np.testing.assert_allclose(irradiance[:, 0], list(CIE_5_6_CEILING_PERCENT.values()), rtol=5e-4)


def test_colors_do_not_mix() -> None:
    """Each channel is a solution of its own."""
    triangles, surface = box_room()
    emission = (surface == CEILING)[:, None] * np.array([1.0, 0.5, 0.0])
    reflectance = np.tile([0.5, 0.2, 0.7], (len(triangles), 1))
    solution = solve(Scene(triangles, reflectance, emission))
    floor = solution.triangle_radiosity[surface == FLOOR]
    np.testing.assert_allclose(floor[:, 0], CUBE_WITH_EMITTING_CEILING[FLOOR], rtol=0.01)
    assert (floor[:, 2] == 0).all()
    one = solve(gray_scene(triangles, 0.2, emission[:, 1:2] * np.ones(3)))
    np.testing.assert_allclose(floor[:, 1], one.triangle_radiosity[surface == FLOOR, 1], rtol=0.01)


def test_the_sides_of_a_wall_are_apart() -> None:
    """A single-plane wall between a lit and a dark room neither glows through nor mixes them."""
    room, _ = box_room((2, 1, 1))
    wall = rectangle((1, 0, 0), (0, 1, 0), (0, 0, 1))
    triangles = np.concatenate([room, wall])
    lamp = PointLight((1.5, 0.5, 0.5), 10.0)
    solution = solve(gray_scene(triangles, 0.8, two_sided=True, lights=[lamp]))
    front, back = solution.triangle_irradiance[-2:], solution.back_irradiance[-2:]
    assert (front > 1.0).all()  # the lit side faces +x
    assert back.max() < 1e-4 * front.min()
    facing = np.array([[0, 0, 1.0], [1, 0, 0]])
    dark = solution.irradiance(np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5]]), facing)
    lit = solution.irradiance(np.array([[1.5, 0.5, 0.0]]), np.array([[0, 0, 1.0]]))
    assert dark.max() < 0.02 * lit.min()


def test_the_back_of_a_one_sided_triangle_blocks_and_absorbs() -> None:
    """Black backs: a lamp above an upside-down floor lights nothing, and its power is accounted for."""
    floor = rectangle((-50, -50, 0), (0, 100, 0), (100, 0, 0))
    solution = solve(gray_scene(floor, 0.8, lights=[PointLight((0, 0, 1), 100.0)]))
    assert (solution.triangle_irradiance == 0).all()
    power = solution.report["power_W"]
    assert power["emitted"] == 100.0
    assert power["absorbed"] + power["escaped"] == pytest.approx(100.0, rel=0.005)
    assert power["absorbed"] == pytest.approx(50.0, rel=0.03)


@pytest.mark.parametrize("elevation", [90.0, 30.0])
def test_sun_on_a_plane(elevation: float) -> None:
    """H = strength · cosθ; a sun counts what arrives."""
    floor = rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0))
    angle = np.radians(elevation)
    sun = SunLight((-np.cos(angle), 0, -np.sin(angle)), 3.0)
    solution = solve(gray_scene(floor, lights=[sun]))
    np.testing.assert_allclose(solution.triangle_irradiance, 3.0 * np.sin(angle), rtol=1e-5)
    power = solution.report["power_W"]
    assert power["emitted"] == pytest.approx(4 * 3.0 * np.sin(angle), rel=1e-5)
    assert power["escaped"] == pytest.approx(0.5 * power["emitted"], rel=1e-3)


def test_sky_over_a_plane_and_a_box() -> None:
    """H = πL in the open; what a closed box covers stays dark."""
    floor = rectangle((-4, -4, 0), (8, 0, 0), (0, 8, 0))
    triangles = np.concatenate([floor, solid_box((-0.5, -0.5, 0), (0.5, 0.5, 1))])
    sky = EnvironmentLight(2.0)
    solution = solve(gray_scene(triangles, 0.0, two_sided=True, lights=[sky]))
    points = np.array([[3.9, 3.9, 0.0], [0, 0, 1.0], [0, 0, 0], [0.45, 0.3, 0]])
    irradiance = solution.irradiance(points, np.tile([0, 0, 1.0], (4, 1)))
    np.testing.assert_allclose(irradiance[1], 2 * np.pi, rtol=1e-6)
    np.testing.assert_allclose(irradiance[0], 2 * np.pi, rtol=0.01)
    assert (irradiance[2:] == 0).all()


def test_area_lamp_is_one_sided_and_casts_no_shadow() -> None:
    """A lamp close below the ceiling lights the floor as Lambert says, and the ceiling not directly."""
    triangles, surface = box_room((2, 2, 2))
    lamp = AreaLight((1, 1, 1.999), (0, 0.5, 0), (0.5, 0, 0), 10.0)
    scene = gray_scene(triangles, 0.0, lights=[lamp])
    solution = solve(scene)
    assert (solution.triangle_irradiance[surface == CEILING] == 0).all()
    assert float(scene.areas @ solution.triangle_irradiance[:, 0]) == pytest.approx(10.0, rel=0.005)
    below = solution.irradiance(np.array([[1.0, 1, 0]]), np.array([[0, 0, 1.0]]))
    expected = 10.0 * lamp.unit_irradiance(np.array([[1.0, 1, 0]]), np.array([[0, 0, 1.0]]))[0]
    np.testing.assert_allclose(below[0], expected, rtol=1e-9)


def test_local_pass_agrees_with_the_elements() -> None:
    """The mean of point irradiances over a triangle is the triangle's own."""
    scene = furnished()
    triangles, solution = scene.triangles, solve(scene)
    weights = np.random.default_rng(1).dirichlet((1, 1, 1), 400)
    for row in (0, 5, 8):
        a, b, c = triangles[row]
        normal = np.cross(b - a, c - a)
        values = solution.irradiance(weights @ triangles[row], np.tile(normal, (len(weights), 1)))
        np.testing.assert_allclose(values.mean(axis=0), solution.triangle_irradiance[row], rtol=0.04)


def test_many_triangles_need_few_links() -> None:
    """A cube room of 20 000 triangles: far fewer first pairs than n², and still the exact means."""
    scene = shining_cube(41)
    assert len(scene) == 20_172
    solution = solve(scene, SolverSettings(error=1e-4))
    assert solution.report["links"] < 300 * len(scene)
    means = wall_means(solution.triangle_radiosity, scene.areas)
    np.testing.assert_allclose(means, np.tile(CUBE_MEANS, (3, 1)).T, rtol=0.01)
    power = solution.report["power_W"]
    assert power["absorbed"] == pytest.approx(power["emitted"], rel=0.005)


def without_times(report: dict) -> dict:
    """Return a report without how long things took, which no two runs share."""
    return {**report, "history": [{**entry, "seconds": 0.0} for entry in report["history"]]}


def test_threads_and_repeats_change_nothing() -> None:
    """The same seed gives the same numbers bit for bit, on one thread and on many."""
    triangles, _ = box_room((3, 2, 2))
    triangles = np.concatenate([triangles, solid_box((0.5, 0.5, 0.3), (1.2, 1.2, 1.0))])
    lamp = PointLight((2.5, 1.5, 1.5), 50.0, radius=0.1)
    scene = gray_scene(triangles, 0.6, two_sided=True, lights=[lamp])
    points = np.random.default_rng(3).uniform(0.1, 0.29, (50, 3))
    up = np.tile([0, 0, 1.0], (50, 1))
    one, two = (solve(scene, SolverSettings(threads=threads)) for threads in (1, 2))
    assert one.triangle_radiosity.tobytes() == two.triangle_radiosity.tobytes()
    assert without_times(one.report) == without_times(two.report)
    assert one.irradiance(points, up).tobytes() == two.irradiance(points, up).tobytes()
    other = solve(scene, SolverSettings(seed=1))
    assert other.triangle_radiosity.tobytes() != one.triangle_radiosity.tobytes()


def test_far_from_the_origin() -> None:
    """A room 10 km away is lit like one at the origin: rays are recentered."""
    triangles, _ = box_room((4, 4, 4))
    far = np.array([10_000.0, -7_000.0, 300.0])
    lamp = PointLight(far + 2, 10_000.0)
    solution = solve(gray_scene(triangles + far, 0.5, lights=[lamp]))
    indirect = solution.triangle_irradiance.mean() - 10_000.0 / 96.0
    assert indirect == pytest.approx(CIE_5_8_INDIRECT_LX[0.5], rel=0.01)
