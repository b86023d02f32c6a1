"""First links: how many there will be, and what becomes of scenes that ask for too many."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver import Scene, SolverSettings
from radiosity_addon.solver.hierarchy.bounds import NodeShapes
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from radiosity_addon.solver.links import initial
from radiosity_addon.solver.links.cluster_links import ClusterLinks
from radiosity_addon.solver.links.element_links import Links
from radiosity_addon.solver.methods import hierarchical
from tests.rooms import box_room, gray, gray_scene, sphere


@pytest.fixture(scope="module")
def clutter() -> Scene:
    """Twelve small balls in a room, from one shining wall: 1,548 triangles."""
    chance = np.random.default_rng(5)
    balls = [0.06 * sphere(2)[:, ::-1] + chance.uniform(0.1, 0.9, 3) for _ in range(12)]
    triangles = np.concatenate([box_room()[0], *balls])
    emission = gray(len(triangles), 0.0)
    emission[:2] = 1.0
    return gray_scene(triangles, 0.5, emission)


def limits_of(hierarchy: Hierarchy, **given: float) -> initial.PairLimits:
    return initial.PairLimits(float(hierarchy.faces.area.sum()), SolverSettings().min_area, **given)


def test_nodes_that_touch_exchange_at_most_the_smaller_area() -> None:
    """However large they are: their gap is 0."""
    large = 1e5 * box_room()[0]
    shapes = NodeShapes(Hierarchy(gray_scene(large)))
    one, other = (each.reshape(-1) for each in np.indices((shapes.count, shapes.count)))
    with np.errstate(all="raise"):
        bound = shapes.exchange_bound(one, other)
    np.testing.assert_array_equal(bound, np.minimum(shapes.area[one], shapes.area[other]))


@pytest.mark.parametrize("faint", [0.0, 1e-5, 1e-3])
def test_the_estimate_predicts_the_number_of_links(
    clutter: Scene, faint: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whole if nothing is thinned, and within five standard errors or so if most is."""
    hierarchy = Hierarchy(clutter)
    shapes, limits = NodeShapes(hierarchy), limits_of(hierarchy, faint=faint)
    pairs = initial.first_pairs(hierarchy, shapes, limits, 10**9)
    assert pairs is not None
    monkeypatch.setattr(initial, "THINNED", 10**9)
    assert initial.estimated_links(hierarchy, shapes, limits) == len(pairs[0])
    monkeypatch.setattr(initial, "THINNED", 1 << 12)
    assert initial.estimated_links(hierarchy, shapes, limits) == pytest.approx(len(pairs[0]), rel=0.15)


def test_the_order_in_which_pairs_are_walked_changes_none(
    clutter: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    hierarchy = Hierarchy(clutter)
    shapes, limits = NodeShapes(hierarchy), limits_of(hierarchy)
    found = []
    for block in (10**9, 1000):
        monkeypatch.setattr(initial, "BLOCK_PAIRS", block)
        pairs = initial.first_pairs(hierarchy, shapes, limits, 10**9)
        assert pairs is not None
        found.append(np.sort(pairs[0].astype(np.int64) << 32 | pairs[1]))
    np.testing.assert_array_equal(*found)
    assert len(np.unique(found[0])) == len(found[0])


def made(scene: Scene, max_links: int) -> tuple[Links, ClusterLinks, float]:
    hierarchy = Hierarchy(scene)
    caster = EmbreeCaster(scene.triangles, 1)
    return initial.first_links(hierarchy, NodeShapes(hierarchy), caster, SolverSettings(), max_links)


def test_a_small_budget_makes_links_coarse_and_says_so(
    clutter: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(initial, "WANTED", np.inf)
    *_, faint = made(clutter, 10**9)
    assert faint == 0.0
    monkeypatch.setattr(initial, "MIN_LINKS", 1)
    told = []
    for budget in (40_000, 10_000):
        links, together, faint = made(clutter, budget)
        assert len(links) + len(together) <= initial.LINK_SLACK * initial.BUDGET * budget
        told.append(faint)
    assert 0 < told[0] < told[1] < 0.1


def test_links_are_few_while_the_error_asks_for_no_finer(
    clutter: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`WANTED` is kept to while `faint` may rise with BF_ε; then there are more, and `faint` says why."""
    hierarchy = Hierarchy(clutter)
    shapes = NodeShapes(hierarchy)
    caster = EmbreeCaster(clutter.triangles, 1)
    monkeypatch.setattr(initial, "WANTED", 600.0)
    links, together, faint = initial.first_links(hierarchy, shapes, caster, SolverSettings(error=1e-3), 10**6)
    assert len(links) + len(together) <= initial.LINK_SLACK * 600 / 1e-3**0.5
    assert 0.0 < faint <= initial.COARSEST_FAINT * 1e-3
    monkeypatch.setattr(initial, "WANTED", 1.0)
    links, together, faint = initial.first_links(hierarchy, shapes, caster, SolverSettings(error=1e-3), 10**6)
    assert len(links) + len(together) > 1 / 1e-3**0.5
    assert 0.5 < faint / (initial.COARSEST_FAINT * 1e-3) <= 1.0


def test_coarse_first_links_still_send_what_there_is(clutter: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every leaf sends no more than it has, and the mean light is that of the fine links."""
    fine = hierarchical.solve(clutter, SolverSettings(error=1e-3))
    monkeypatch.setattr(initial, "MIN_LINKS", 1)
    settings = SolverSettings(error=1e-3, max_links=10_000)
    coarse = hierarchical.solve(clutter, settings)
    # Finer than BF_ε asks for none need be; a short budget alone makes them coarser.
    assert fine.details["hierarchical"]["first_faint"] <= initial.COARSEST_FAINT * 1e-3
    assert coarse.details["hierarchical"]["first_faint"] > fine.details["hierarchical"]["first_faint"]
    assert coarse.n_links <= 10_000
    assert coarse.residual < settings.tolerance
    means = [
        state.hierarchy.faces.area @ state.irradiance[: len(state.hierarchy.faces), 0]
        for state in (fine, coarse)
    ]
    assert means[1] == pytest.approx(means[0], rel=0.02)
