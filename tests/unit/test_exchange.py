"""What pairs of elements exchange: one number for both, whoever asks."""

from __future__ import annotations

import numpy as np

from radiosity_addon.form_factors.formulas import triangle_to_triangle
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver.equations.exchange import exchange_areas
from radiosity_addon.solver.equations.fixed_elements import subdivide_evenly
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from radiosity_addon.solver.links.pair_factors import PairSamples, open_share, pair_visibility, trace_pairs
from tests.rooms import box_room, gray_scene
from tests.unit.solved_rooms import corridor, furnished


def grown() -> tuple[Hierarchy, EmbreeCaster, np.ndarray, np.ndarray]:
    """A room with a box, some of its faces split once or twice, and all pairs of its elements."""
    scene = furnished()
    hierarchy = Hierarchy(scene)
    hierarchy.subdivide(np.arange(0, len(hierarchy.faces), 2))
    hierarchy.subdivide(np.arange(len(hierarchy.faces), len(hierarchy.faces) + 9))
    one, other = np.divmod(np.arange(hierarchy.n_elements**2), hierarchy.n_elements)
    return hierarchy, EmbreeCaster(scene.triangles), one, other


def test_both_directions_are_the_same_bits() -> None:
    hierarchy, caster, one, other = grown()
    there = exchange_areas(hierarchy, caster, one, other, seed=3)
    back = exchange_areas(hierarchy, caster, other, one, seed=3)
    assert (there > 0).mean() > 0.3
    np.testing.assert_array_equal(there, back)
    assert (there[one == other] == 0).all()


def test_company_and_threads_change_no_bit() -> None:
    """A row of a matrix, a column, a link: asked alone, in any order, in any chunk."""
    hierarchy, caster, one, other = grown()
    whole = exchange_areas(hierarchy, caster, one, other, seed=3, threads=1)
    np.testing.assert_array_equal(exchange_areas(hierarchy, caster, one, other, seed=3, threads=2), whole)
    rng = np.random.default_rng(4)
    for count in (1, 2, 3, 5, 17, 100, 999):
        for _ in range(20):
            rows = rng.choice(len(one), count, replace=False)
            part = exchange_areas(hierarchy, caster, one[rows], other[rows], seed=3)
            np.testing.assert_array_equal(part, whole[rows])


def test_in_a_convex_room_it_is_the_factor_times_the_area() -> None:
    scene = corridor()
    hierarchy = Hierarchy(scene)
    one, other = np.divmod(np.arange(hierarchy.n_elements**2), hierarchy.n_elements)
    exchange = exchange_areas(hierarchy, EmbreeCaster(scene.triangles), one, other, seed=0)
    exact = triangle_to_triangle(hierarchy.corners[one], hierarchy.corners[other])
    np.testing.assert_allclose(exchange, hierarchy.area[one] * exact, atol=2e-4 * hierarchy.area.max())
    closure = exchange.reshape(len(hierarchy.face), -1).sum(axis=1) / hierarchy.area
    np.testing.assert_allclose(closure, 1.0, atol=2e-3)


def test_visibility_asks_no_more_samples_than_it_needs() -> None:
    """Four where they agree, sixteen where not: the bits of asking all pairs for all their samples."""
    hierarchy, caster, one, other = grown()
    source = hierarchy.n_clusters + other
    samples = PairSamples(hierarchy, one, source, 3)
    traced, free = trace_pairs(caster, samples, empty_too=True)
    visibility = pair_visibility(hierarchy, caster, one, source, 3)
    np.testing.assert_array_equal(visibility, open_share(samples.transfer, traced, free)[0])
    assert set(np.unique(traced.sum(axis=1))) >= {4, 16}
    assert {0.0, 1.0} < set(visibility.tolist())


def test_nothing_passes_between_closed_rooms() -> None:
    """Pairs that hardly face each other have few samples that carry anything; that is not a free view."""
    room, _ = box_room()
    beside = room * (0.8, 1.0, 0.7) + (2.0, 0.0, 0.0)
    triangles = np.concatenate([room, beside])
    hierarchy = Hierarchy(gray_scene(triangles, 0.5, 1.0))
    subdivide_evenly(hierarchy, 192)
    leaves = hierarchy.leaves
    here = hierarchy.face[leaves] < len(room)
    one, other = (part.ravel() for part in np.meshgrid(leaves[here], leaves[~here]))
    assert (exchange_areas(hierarchy, EmbreeCaster(triangles), one, other, seed=0) == 0).all()
