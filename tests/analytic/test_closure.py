"""Closed scenes of medium quality: all that leaves a triangle arrives at one, and no power is made or lost.

ΣFV, as light is exchanged, within 1 % on each triangle and 0.2 % over all; the power within 0.2 %. The links
as measured miss both where things hide each other: that too is asserted, or nothing would be tested.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bench.rooms import room
from radiosity_addon.bake.quality import QUALITY_SETTINGS
from radiosity_addon.numerics.sampling import cosine_hemisphere, points_on_triangles, to_world
from radiosity_addon.solver import PointLight, Scene, Solution
from radiosity_addon.solver.methods.hierarchical import HierarchicalState, solve
from tests.cornell import cornell_box
from tests.rooms import CEILING, box_room, colored_room, gray, gray_scene, solid_box

ON_A_TRIANGLE, OVER_ALL, POWER = 0.01, 0.002, 0.002


def furnished() -> Scene:
    """Twenty-four large triangles, every one of which is split; a box in the air hides them."""
    triangles = np.concatenate([box_room((3, 2, 2))[0], solid_box((0.5, 0.5, 0.3), (1.2, 1.2, 1.0))])
    reflectance = np.random.default_rng(5).uniform(0.0, 0.9, (len(triangles), 3))
    lamp = PointLight((2.5, 1.5, 1.5), 50.0)
    return Scene(triangles, reflectance, gray(len(triangles), 0.0), lights=[lamp])


def cornell_with_a_front(two_sided: bool = False) -> Scene:
    """The Cornell box with its open side closed; its blocks have no bottoms, its lamp's back may be black."""
    box = cornell_box()
    a, b, c, d = np.array([(0, 0, 0), (5.528, 0, 0), (5.56, 5.488, 0), (0, 5.488, 0)])
    return Scene(
        np.concatenate([box.triangles, [(a, b, c), (a, c, d)]]),
        np.concatenate([box.reflectance, gray(2, 0.5)]),
        np.concatenate([box.emission, gray(2, 0.0)]),
        two_sided=two_sided,
    )


def enclosure() -> Scene:
    """Everything shines alike, and reflects nine tenths, in a room of 300 triangles: B = 10 E everywhere."""
    triangles, _ = box_room((1, 2, 0.5), 5)
    return gray_scene(triangles, 0.9, 1.0)


def cube_in_a_cube() -> Scene:
    """One cube in the middle of another of three times its size, whose ceiling shines."""
    outer, surface = box_room((3, 3, 3))
    triangles = np.concatenate([outer, solid_box((1, 1, 1), (2, 2, 2))])
    emission = gray(len(triangles), 0.0)
    emission[: len(outer)][surface == CEILING] = 1.0
    return gray_scene(triangles, 0.7, emission)


def boxes_that_touch() -> Scene:
    """Boxes stand on the floor, on each other and against each other: faces in one plane, back to back."""
    room, surface = box_room((4, 4, 3), n=2)
    boxes = [
        solid_box((1, 1, 0), (2, 2, 1)),
        solid_box((2, 1, 0), (3, 2, 1.5)),
        solid_box((1, 1, 1), (2, 2, 2)),
    ]
    triangles = np.concatenate([room, *boxes])
    emission = gray(len(triangles), 0.0)
    emission[: len(room)][surface == CEILING] = 1.0
    return gray_scene(triangles, 0.6, emission)


SCENES = {
    "furnished": furnished,
    "colored": colored_room,
    "cornell with a front": cornell_with_a_front,
    "cornell of two sides": lambda: cornell_with_a_front(two_sided=True),
    "enclosure": enclosure,
    "cube in a cube": cube_in_a_cube,
    "boxes that touch": boxes_that_touch,
    "room of 300": lambda: room(300)[0],
    "room of 1000": lambda: room(1000)[0],
}


@cache
def solved(name: str) -> HierarchicalState:
    return solve(SCENES[name](), QUALITY_SETTINGS["medium"].solver)


DARK = {"boxes that touch": 17, "cornell with a front": 4}
"""Triangles that see black backs: what lies under one-sided boxes, and the ceiling above the lamp."""


@pytest.mark.parametrize("name", SCENES)
def test_all_that_leaves_a_triangle_arrives(name: str) -> None:
    """On each from which no black back is seen; but few see any."""
    state = solved(name)
    count = len(state.scene)
    sides = state.conservation.closed(state.hierarchy)[:count]
    assert (~sides).sum() == DARK.get(name, 0)
    solution = Solution(state)
    np.testing.assert_allclose(solution.triangle_closure[sides], 1.0, atol=ON_A_TRIANGLE)
    areas = state.scene.areas[sides]
    assert areas @ solution.triangle_closure[sides] / areas.sum() == pytest.approx(1.0, abs=OVER_ALL)
    if sides.all():
        assert solution.report["closure_area_mean"] == pytest.approx(1.0, abs=OVER_ALL)


def test_the_rest_receives_what_does_not_end_on_black_backs() -> None:
    """In the Cornell box with a front: the floor under the blocks, the ceiling above the lamp."""
    state = solved("cornell with a front")
    sides = np.flatnonzero(~state.conservation.closed(state.hierarchy))
    faces, count = state.hierarchy.faces, 100_000
    rng = np.random.default_rng(8)
    for side in sides:
        points = points_on_triangles(faces.corners[side][None], rng.uniform(size=(1, count, 2)))[0]
        normals = np.repeat(faces.normal[side][None], count, axis=0)
        directions = to_world(cosine_hemisphere(rng.uniform(size=(count, 1, 2))), normals)[:, 0]
        hits = state.caster.intersect(points + state.caster.surface_offset * normals, directions)
        assert 0.75 < hits.front.mean() < 0.98
        assert state.balanced_closure()[side] == pytest.approx(hits.front.mean(), abs=ON_A_TRIANGLE)


@pytest.mark.parametrize("name", SCENES)
def test_no_power_is_made_or_lost(name: str) -> None:
    power = Solution(solved(name)).report["power_W"]
    assert power["absorbed"] == pytest.approx(power["emitted"], rel=POWER)
    assert power["escaped"] == 0.0


def test_where_all_shines_alike_it_is_equally_bright() -> None:
    """B = E / (1 − ρ) on every leaf's triangle."""
    radiosity = Solution(solved("enclosure")).triangle_radiosity
    np.testing.assert_allclose(radiosity, 10.0, rtol=5e-3)


@pytest.mark.parametrize(
    "name", ["colored", "room of 300", "room of 1000", "cornell with a front", "cornell of two sides"]
)
def test_links_alone_would_not_do(name: str) -> None:
    assert np.abs(solved(name).closure() - 1.0).max() > ON_A_TRIANGLE
