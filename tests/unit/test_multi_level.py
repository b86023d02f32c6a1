"""The multi-level hierarchy: its links, its budget, its iteration, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.quality import quality_of
from radiosity_addon.base.errors import UsageError
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.solver import Scene, SolverSettings, solve
from radiosity_addon.solver.equations.exchange import exchange_areas
from radiosity_addon.solver.equations.refine_patch import facing_pairs
from radiosity_addon.solver.hierarchy.nodes import LEAF, Hierarchy
from radiosity_addon.solver.links.census import elements_by_level, leaves_by_level, links_by_level
from radiosity_addon.solver.links.transport import gather
from radiosity_addon.solver.methods import hierarchical, multi_level
from radiosity_addon.solver.methods.multi_level import MultiLevelState, refuse_too_many_faces
from radiosity_addon.solver.state import memory
from tests.published import shining_cube
from tests.rooms import box_room, gray_scene
from tests.unit.solved_rooms import furnished


def scene_of(triangles: np.ndarray, two_sided: bool = False) -> Scene:
    return gray_scene(triangles, 0.5, 1.0, two_sided=two_sided)


def multi_level_state(scene: Scene, **settings: float) -> MultiLevelState:
    return multi_level.solve(scene, SolverSettings(method="multi-level", **settings))


# --- links of pairs -----------------------------------------------------------------------------


def test_links_carry_less_than_the_error_or_join_the_finest() -> None:
    error, min_area = 0.03, 0.01
    state = multi_level_state(furnished(), form_factor_error=error, min_area=min_area)
    hierarchy, links = state.hierarchy, state.links
    source = links.source - hierarchy.n_clusters
    area_to, area_of = hierarchy.area[links.receiver], hierarchy.area[source]
    small = links.factor * area_to / area_of < error
    finest = np.maximum(area_to, area_of) < 4 * min_area * hierarchy.faces.area.sum()
    assert (small | finest).all()
    assert 0.2 < small.mean() < 1


# --- the budget -------------------------------------------------------------------------------


def test_the_budget_limits_the_links_and_what_is_left_is_reported() -> None:
    scene, budget = furnished(), 3000
    whole = multi_level_state(scene, form_factor_error=0.01, min_area=1e-3)
    assert len(whole.links) > 3 * budget
    assert whole.over_budget == 0.0
    state = multi_level_state(scene, form_factor_error=0.01, min_area=1e-3, max_links=budget)
    assert len(state.links) <= budget
    assert 0 < state.over_budget < 1


def test_a_budget_below_the_first_pairs_keeps_them_all() -> None:
    state = multi_level_state(shining_cube(), max_links=1)
    assert state.details["multi_level"]["links_by_level"] == [
        {"receiver_level": 0, "source_level": 0, "links": len(facing_pairs(state.hierarchy)[0])}
    ]
    # The brightest pair left: a face of the ceiling may send all its light to a wall it touches.
    sent = 0.5 * state.radiosity[:12, 0].max() / state.power
    assert state.over_budget == pytest.approx(sent, rel=1e-12)


def test_too_many_faces_are_refused_beforehand() -> None:
    """64 bytes for each ordered pair: 10 000 faces need 6 GiB."""
    refuse_too_many_faces(10_000, 6.0)
    with pytest.raises(
        UsageError, match=r"99,990,000 pairs of 10,000 faces.* 5\.96 GiB.*5 GiB.*hierarchical"
    ):
        refuse_too_many_faces(10_000, 5.0)
    settings = SolverSettings(method="multi-level", memory_limit=1e-6)
    with pytest.raises(UsageError, match="12 faces"):
        solve(shining_cube(), settings)


# --- links ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def state() -> MultiLevelState:
    made = multi_level_state(furnished(), form_factor_error=0.02, min_area=2e-3)
    assert len(set(made.hierarchy.level[made.links.source - made.hierarchy.n_clusters].tolist())) > 2
    return made


def test_links_are_reciprocal_exactly(state: MultiLevelState) -> None:
    """A_r F_rs = A_s F_sr wherever a pair is linked both ways, from one number for both."""
    hierarchy, links = state.hierarchy, state.links
    source = links.source - hierarchy.n_clusters
    exchange = dict(
        zip(zip(links.receiver.tolist(), source.tolist(), strict=True), links.factor, strict=True)
    )
    both = [(r, s) for r, s in exchange if (s, r) in exchange]
    assert len(both) > 1000
    for r, s in both:
        assert exchange[r, s] * hierarchy.area[r] == pytest.approx(
            exchange[s, r] * hierarchy.area[s], rel=4e-16, abs=0
        )
        if hierarchy.area[r] == hierarchy.area[s]:
            assert exchange[r, s] == exchange[s, r]


def test_links_are_float64_and_what_is_exchanged(state: MultiLevelState) -> None:
    hierarchy, links = state.hierarchy, state.links
    assert links.factor.dtype == np.float64
    assert (links.visibility == 1).all()
    source = links.source - hierarchy.n_clusters
    exchange = exchange_areas(hierarchy, state.caster, links.receiver, source, state.settings.seed)
    np.testing.assert_array_equal(links.factor, exchange / hierarchy.area[links.receiver])
    assert (np.diff(links.receiver) >= 0).all()


def test_gather_keeps_float64(state: MultiLevelState) -> None:
    """As a matrix of the links: the area mean of each source's leaves, to the last digits."""
    hierarchy, links = state.hierarchy, state.links
    radiosity = np.random.default_rng(2).uniform(0, 1, (hierarchy.n_elements, 1))
    means = radiosity[:, 0].copy()
    for parent in np.flatnonzero(hierarchy.first_child != LEAF)[::-1]:
        means[parent] = means[hierarchy.first_child[parent] + np.arange(4)].mean()
    expected = np.bincount(
        links.receiver, links.factor * means[links.source - hierarchy.n_clusters], hierarchy.n_elements
    )
    got = gather(hierarchy, links, radiosity)
    np.testing.assert_allclose(got[..., 0], np.tile(expected[:, None], 4), rtol=1e-13)


def test_the_census_counts_every_link_and_element(state: MultiLevelState) -> None:
    hierarchy, links = state.hierarchy, state.links
    told = state.details["multi_level"]
    assert sum(row["links"] for row in told["links_by_level"]) == len(links)
    assert sum(told["elements_by_level"]) == hierarchy.n_elements
    assert sum(told["leaves_by_level"]) == len(hierarchy.leaves)
    for row in told["links_by_level"]:
        of = hierarchy.level[links.source - hierarchy.n_clusters] == row["source_level"]
        to = hierarchy.level[links.receiver] == row["receiver_level"]
        assert (of & to).sum() == row["links"]


def test_the_census_puts_clusters_below_the_faces() -> None:
    hierarchy = Hierarchy(furnished())
    n = hierarchy.n_clusters
    hierarchy.subdivide(np.array([2]))
    assert elements_by_level(hierarchy) == [len(hierarchy.faces), 4]
    assert leaves_by_level(hierarchy) == [len(hierarchy.faces) - 1, 4]
    child = len(hierarchy.faces)
    counted = links_by_level(hierarchy, np.array([0, child, 1, 0]), np.array([n, 0, 1, n + child]))
    assert counted == [
        {"receiver_level": 0, "source_level": -1, "links": 1},
        {"receiver_level": 0, "source_level": 0, "links": 1},
        {"receiver_level": 0, "source_level": 1, "links": 1},
        {"receiver_level": 1, "source_level": -1, "links": 1},
    ]


# --- iterating --------------------------------------------------------------------------------


def test_the_residual_falls_by_the_reflectance_each_bounce() -> None:
    """In a closed room of one reflectance every bounce keeps that share of the power."""
    state = multi_level_state(furnished(0.6), form_factor_error=0.05, tolerance=1e-8)
    residuals = np.array([entry.residual for entry in state.history if entry.iteration > 2])
    np.testing.assert_allclose(residuals[1:] / residuals[:-1], 0.6, atol=0.02)


def test_one_iteration_is_one_bounce() -> None:
    """Gather reads the previous radiosity: after one, only what the ceiling sent straight."""
    settings = SolverSettings(method="multi-level", form_factor_error=0.0, min_area=0.05, max_iterations=1)
    state = multi_level.solve(shining_cube(), settings)
    floor = state.hierarchy.faces.area[:2] @ state.irradiance[:2, 0]
    assert floor == pytest.approx(0.1998248957, rel=1e-4)  # Howell C-11
    assert state.irradiance[2:4].max() == 0.0  # the ceiling itself gets nothing yet


def test_rounds_tell_how_the_threshold_fell() -> None:
    settings = SolverSettings(error=1e-3)
    state = hierarchical.solve(furnished(), settings)
    rounds = state.details["hierarchical"]["rounds"]
    np.testing.assert_allclose([r["error"] for r in rounds], [0.064, 0.016, 0.004, 0.001])
    assert [r["links"] for r in rounds] == sorted(r["links"] for r in rounds)
    assert rounds[-1]["links"] == len(state.links)
    assert rounds[-1]["links_refined"] > 0
    assert sum(row["links"] for row in state.details["hierarchical"]["links_by_level"]) == len(state.links)


def test_a_lone_shining_triangle_has_nothing_to_link() -> None:
    solution = solve(scene_of(box_room()[0][:1]), SolverSettings(method="multi-level"))
    np.testing.assert_array_equal(solution.triangle_radiosity, 1.0)
    assert solution.report["links"] == 0


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, 0.003),
        ({"form_factor_error": 0.1}, 0.03),
        ({"form_factor_error": 0.0}, 2e-5),
        ({"min_area": 1e-4}, 1e-4),
    ],
)
def test_a_bake_limits_the_area_by_the_form_factor_error(given: dict[str, float], expected: float) -> None:
    """So that sources are split too: see MULTI_LEVEL_AREA; the refined hierarchy keeps the preset's."""
    assert quality_of(BakeSettings(method="multi-level", **given)).solver.min_area == pytest.approx(expected)
    given.pop("form_factor_error", None)
    hierarchical = quality_of(BakeSettings(method="hierarchical", **given)).solver
    assert hierarchical.min_area == given.get("min_area", 2e-5)


def test_memory_bounds_the_links_of_the_refined_hierarchy() -> None:
    """A limit too small for what the error asks stops refinement like a budget of links, and says so."""
    free = hierarchical.solve(furnished(), SolverSettings(error=1e-3))
    settings = SolverSettings(error=1e-3, memory_limit=1.0)
    others = 2**30 - memory.free_bytes(free.hierarchy, settings)
    limit = (others + (len(free.links) // 2) * memory.LINK_BYTES) / 2**30
    tight = SolverSettings(error=1e-3, memory_limit=limit)
    bound = hierarchical.solve(furnished(), tight)
    assert free.over_budget == 0.0
    assert bound.over_budget > 1e-3
    assert len(bound.links) <= memory.link_budget(bound.hierarchy, tight, 0) < len(free.links)
