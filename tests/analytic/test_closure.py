"""Closed scenes of medium quality: all that leaves a triangle arrives at one, and no power is made or lost.

ΣFV, as light is exchanged, within 1 % on each triangle and 0.2 % over all; the power within 0.2 %. The links
as measured miss both where things hide each other: that too is asserted, or nothing would be tested.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bench.rooms import room
from radiosity_addon.quality import QUALITIES
from radiosity_addon.solver import PointLight, Scene, Solution
from radiosity_addon.solver.methods.hierarchical import HierarchicalState, solve_steps
from tests.cornell import cornell_box
from tests.rooms import box_room, coloured_room, grey, solid_box

ON_A_TRIANGLE, OVER_ALL, POWER = 0.01, 0.002, 0.002


def furnished() -> Scene:
    """Twenty-four large triangles, every one of which is split; a box in the air hides them."""
    triangles = np.concatenate([box_room((3, 2, 2))[0], solid_box((0.5, 0.5, 0.3), (1.2, 1.2, 1.0))])
    reflectance = np.random.default_rng(5).uniform(0.0, 0.9, (len(triangles), 3))
    lamp = PointLight((2.5, 1.5, 1.5), 50.0)
    return Scene(triangles, reflectance, grey(len(triangles), 0.0), lights=[lamp])


def cornell_with_a_front() -> Scene:
    """The Cornell box with its open side closed; its blocks have no bottoms, its lamp has a black back."""
    box = cornell_box()
    a, b, c, d = np.array([(0, 0, 0), (5.528, 0, 0), (5.56, 5.488, 0), (0, 5.488, 0)])
    return Scene(
        np.concatenate([box.triangles, [(a, b, c), (a, c, d)]]),
        np.concatenate([box.reflectance, grey(2, 0.5)]),
        np.concatenate([box.emission, grey(2, 0.0)]),
    )


SCENES = {
    "furnished": furnished,
    "coloured": coloured_room,
    "cornell with a front": cornell_with_a_front,
    "room of 300": lambda: room(300)[0],
    "room of 1000": lambda: room(1000)[0],
}


@cache
def solved(name: str) -> HierarchicalState:
    *_, (_, state) = solve_steps(SCENES[name](), QUALITIES["medium"].solver)
    return state


@pytest.mark.parametrize("name", SCENES)
def test_all_that_leaves_a_triangle_arrives(name: str) -> None:
    """In the Cornell box on those from which no black back is seen: the floor and the ceiling see some."""
    state = solved(name)
    sides = state.conservation.closed(state.hierarchy)
    assert sides.mean() > 0.85 if name == "cornell with a front" else sides.all()
    solution = Solution(state)
    np.testing.assert_allclose(solution.triangle_closure[sides], 1.0, atol=ON_A_TRIANGLE)
    areas = state.scene.areas[sides]
    assert areas @ solution.triangle_closure[sides] / areas.sum() == pytest.approx(1.0, abs=OVER_ALL)
    if sides.all():
        assert solution.report["closure_area_mean"] == pytest.approx(1.0, abs=OVER_ALL)


@pytest.mark.parametrize("name", SCENES)
def test_no_power_is_made_or_lost(name: str) -> None:
    power = Solution(solved(name)).report["power_W"]
    assert power["absorbed"] == pytest.approx(power["emitted"], rel=POWER)
    assert power["escaped"] == 0.0


@pytest.mark.parametrize("name", ["coloured", "room of 300", "room of 1000"])
def test_links_alone_would_not_do(name: str) -> None:
    assert np.abs(solved(name).closure() - 1.0).max() > ON_A_TRIANGLE
