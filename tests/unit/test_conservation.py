"""Every leaf sends out what it has: the sums over links after scaling, and what follows from them."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver.balance.conservation import LIMIT_CLOSED, Conservation
from radiosity_addon.solver.balance.link_sums import sent, sent_by_leaves
from radiosity_addon.solver.hierarchy.nodes import LEAF
from radiosity_addon.solver.links.cluster_links import gather_at_clusters
from radiosity_addon.solver.links.transport import gather, node_radiosity, pull, push
from radiosity_addon.solver.methods.hierarchical import HierarchicalState
from tests.rooms import CEILING, box_room, gray, gray_scene, rectangle
from tests.unit.solved_rooms import corridor, furnished, solved


@pytest.fixture(scope="module", params=["few faces", "many faces"])
def closed(request: pytest.FixtureRequest) -> HierarchicalState:
    """A closed scene whose links go to elements, and one where most go to clusters."""
    if request.param == "few faces":
        return solved(furnished(), error=1e-3)
    state = solved(corridor(), error=5e-3)
    assert len(state.cluster_links) > 200
    return state


def factors(state: HierarchicalState, conservation: Conservation | None = None) -> np.ndarray:
    conservation = conservation or state.conservation
    return conservation.factors(state.hierarchy, state.cut, state.links, state.cluster_links)


def received(state: HierarchicalState, scale: np.ndarray | None) -> np.ndarray:
    """Return (l,) the share of each leaf's light that all elements gather, by lighting one by one."""
    hierarchy = state.hierarchy
    leaves = hierarchy.leaves
    radiosity = np.zeros((hierarchy.n_elements, len(leaves)))
    radiosity[leaves, np.arange(len(leaves))] = 1.0
    arriving = gather(hierarchy, state.links, radiosity, scale).mean(axis=1)
    means = pull(hierarchy, radiosity if scale is None else scale[:, 1:] * radiosity)
    sent_to = node_radiosity(hierarchy, means)
    count = len(hierarchy.faces)
    arriving[:count] += gather_at_clusters(hierarchy, state.cut, state.cluster_links, sent_to)
    return np.asarray(hierarchy.area @ arriving / hierarchy.area[leaves])


def test_every_leaf_sends_what_arrives(closed: HierarchicalState) -> None:
    """In a closed scene all of it, but where there are too few shared links to carry the rest; never more."""
    factor = factors(closed)[closed.hierarchy.leaves]
    share = received(closed, factors(closed))
    assert share.max() < 1 + 1e-4
    enough = (factor[:, 1] < LIMIT_CLOSED) & (factor[:, 1] != 1)
    assert enough.mean() > 0.8
    np.testing.assert_allclose(share[enough], 1.0, atol=1e-4)


def test_scaling_brings_the_sums_nearer_to_what_arrives(closed: HierarchicalState) -> None:
    """And the area mean, which push and pull need, near to 1."""
    hierarchy = closed.hierarchy
    area = hierarchy.area[hierarchy.leaves]
    plain, scaled = received(closed, None), received(closed, factors(closed))
    assert area @ np.abs(scaled - 1) < 0.2 * (area @ np.abs(plain - 1))
    assert area @ scaled / area.sum() == pytest.approx(1.0, abs=0.005)
    assert area @ plain / area.sum() == pytest.approx(1.0, abs=0.02)


def test_factors_are_bounded_and_only_the_leaves(closed: HierarchicalState) -> None:
    hierarchy = closed.hierarchy
    factor = factors(closed)
    assert factor.shape == (hierarchy.n_elements, 2)
    assert (factor >= 0).all()
    assert (factor <= [1.0, LIMIT_CLOSED]).all()
    assert (factor[hierarchy.first_child != LEAF] == 1).all()
    np.testing.assert_array_equal(closed.sent, factor)


def test_sent_is_the_transpose_of_gather(closed: HierarchicalState) -> None:
    """Σ_r A_r F_rs V_rs / A_s, checked by lighting one leaf source after another."""
    hierarchy, links = closed.hierarchy, closed.links
    n = hierarchy.n_clusters
    leaves = hierarchy.leaves
    own = links.take((links.source >= n) & (hierarchy.first_child[np.maximum(links.source - n, 0)] == LEAF))
    radiosity = np.zeros((hierarchy.n_elements, len(leaves)))
    radiosity[leaves, np.arange(len(leaves))] = 1.0
    arriving = gather(hierarchy, own, radiosity).mean(axis=1)
    expected = hierarchy.area @ arriving / hierarchy.area[leaves]
    shares = sent(hierarchy, links)[leaves, :, 0]
    np.testing.assert_allclose(shares.mean(axis=1), expected, rtol=1e-4, atol=1e-7)


def test_open_scene_sends_less() -> None:
    """Without its ceiling a cube loses what goes up: F to it from the floor is 0.19982."""
    room, surface = box_room()
    kept = surface != CEILING
    emission = gray(len(room), 0.0)
    emission[surface == 0] = 1.0
    state = solved(gray_scene(room[kept], 0.5, emission[kept]), error=1e-3)
    factor = factors(state)
    share = received(state, factor)
    hierarchy = state.hierarchy
    face = hierarchy.face[hierarchy.leaves]
    floor = face < 2
    area = hierarchy.area[hierarchy.leaves]
    assert area[floor] @ share[floor] / area[floor].sum() == pytest.approx(1 - 0.19982, abs=0.01)


@pytest.mark.parametrize("reflectance", [0.9, 0.99])
def test_the_iteration_converges_and_keeps_the_power(reflectance: float) -> None:
    """No leaf sends more than it has, so a hundred bounces neither blow up nor fade."""
    scene = furnished(reflectance)
    state = solved(scene, error=1e-2, tolerance=1e-4)
    assert state.residual < 1e-4
    leaves = state.hierarchy.leaves
    absorbed = (1 - reflectance) * state.hierarchy.area[leaves] @ state.irradiance[leaves]
    emitted = scene.areas @ scene.emission
    np.testing.assert_allclose(absorbed, emitted, rtol=0.02)


def test_factors_do_not_depend_on_when_leaves_appeared() -> None:
    """Rays of a leaf are placed by its own number: measured at once or as the solver refines, the same."""
    state = solved(furnished(), error=2e-3)
    min_area = state.settings.min_area * float(state.hierarchy.faces.area.sum())
    fresh = Conservation(state.caster, min_area, state.settings.seed, threads=1)
    np.testing.assert_array_equal(factors(state, fresh), factors(state))


@pytest.fixture(scope="module")
def cluttered() -> HierarchicalState:
    """A closed room of 588 triangles with a tessellated box in it: most links go to clusters."""
    room, surface = box_room((3, 2, 2), n=6)
    box = box_room((0.8, 0.8, 0.8), n=3)[0][:, ::-1] + (0.6, 0.5, 0.3)
    triangles = np.concatenate([room, box])
    emission = gray(len(triangles), 0.0)
    emission[: len(room)][surface == CEILING] = 1.0
    return solved(gray_scene(triangles, 0.7, emission), error=1e-3)


def test_closure_is_that_of_the_light_exchanged(cluttered: HierarchicalState) -> None:
    """Over all ΣFV is 1, as every leaf sends what it has; of single faces neither sum is exact."""
    plain, balanced = cluttered.closure(), cluttered.balanced_closure()
    whole = cluttered.hierarchy.first_child[: len(plain)] == LEAF
    assert 0.5 < whole.mean() < 1.0
    reported = cluttered.details["hierarchical"]["closure"]
    area = cluttered.hierarchy.faces.area
    share = area / area.sum()
    assert share @ balanced == pytest.approx(1.0, abs=5e-4)
    assert abs(share @ plain - 1.0) > 1e-3
    for name, sums in (("links", plain), ("balanced", balanced)):
        assert reported[name]["mean"] == pytest.approx(share @ sums, rel=1e-9)
        assert reported[name]["rms"] == pytest.approx(np.sqrt(share @ (sums - 1) ** 2), rel=1e-9)
        assert reported[name]["off"] == pytest.approx(share @ (np.abs(sums - 1) > 0.01), rel=1e-9)
    absorbed = (1 - 0.7) * area @ cluttered.irradiance[: len(area)]
    emitted = area @ cluttered.hierarchy.faces.emission
    np.testing.assert_allclose(absorbed, emitted, rtol=2e-3)
    np.testing.assert_allclose(absorbed / emitted, 1.0, atol=5e-4)


def test_own_links_are_not_scaled_down_for_noise() -> None:
    """In an open scene half of the leaves' rays tell less than what arrives; own links know better."""
    room, surface = box_room(n=2)
    kept = surface != CEILING
    emission = gray(len(room), 0.0)
    emission[surface == 0] = 1.0
    state = solved(gray_scene(room[kept], 0.5, emission[kept]), error=0.1)
    hierarchy, arrivals = state.hierarchy, state.conservation.arrivals
    leaves = hierarchy.leaves
    own, _ = sent_by_leaves(hierarchy, state.cut, state.links, state.cluster_links)
    own, arriving, error = own[leaves], arrivals.share[leaves], arrivals.error(leaves)
    factor = factors(state)[leaves]
    assert (own > arriving + 1e-6).mean() > 0.1
    np.testing.assert_array_equal(factor[own < np.minimum(arriving + 2.9 * error, 1.0), 0], 1.0)
    assert (factor[:, 0] * own < 1 + 1e-12).all()
    # Nothing is left for shared links then.
    assert (factor[own > arriving, 1] <= 1.0).all()


def test_partly_covered_faces_are_sent_what_their_quarters_take() -> None:
    """A link's light lands on few quarters of its receiver: each takes by what is left of it alone."""
    x, y, _ = np.eye(3)
    panels = [
        rectangle((0.2, 0.2, 0.5), 0.6 * x, 0.6 * y),
        rectangle((0.5, 0.2, 0.5), 0.45 * x, 0.6 * y),
        rectangle((0.3, 0.1, 0.55), 0.6 * y, 0.6 * x),
        rectangle((0.3, 0.4, 0.55), 0.45 * y, 0.6 * x),
    ]
    room, _ = box_room()
    triangles = np.concatenate([room, *panels])
    emission = gray(len(triangles), 0.0)
    emission[:2] = 1.0
    state = solved(gray_scene(triangles, 0.9, emission, two_sided=True), error=0.02, min_area=1e-3)
    hierarchy, leaves = state.hierarchy, state.hierarchy.leaves
    radiosity = np.zeros((hierarchy.n_elements, len(leaves)))
    radiosity[leaves, np.arange(len(leaves))] = 1.0
    taken = push(hierarchy, gather(hierarchy, state.links, radiosity, state.sent))
    area = hierarchy.area[leaves]
    shares = (area * hierarchy.opacity[leaves]) @ taken[leaves] / area
    assert len(state.cluster_links) == 0
    assert shares[hierarchy.opacity[leaves] > 0].max() < 1.001
