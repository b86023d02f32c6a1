"""Links to clusters: what they carry, against sums over single faces and exact factors."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.form_factors.formulas import point_to_polygon
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver import SolverSettings
from radiosity_addon.solver.hierarchy.bounds import NodeShapes
from radiosity_addon.solver.hierarchy.cluster_cut import ClusterCut
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from radiosity_addon.solver.links.cluster_links import ClusterLinks, gather_at_clusters, no_cluster_links
from radiosity_addon.solver.links.cluster_pairs import measure_cluster_links
from radiosity_addon.solver.links.element_links import Links
from radiosity_addon.solver.links.initial import CONE, FACE_SIZE, MAX_RADII, MIXED_SIZE, first_links
from radiosity_addon.solver.links.transport import node_radiosity
from radiosity_addon.solver.state.power import link_closure
from tests.rooms import box_room, gray, gray_scene, rectangle, sphere

MANY = 6_000_000
"""Budget of links that nothing here exhausts."""


def prepared(triangles: np.ndarray) -> tuple[Hierarchy, NodeShapes, EmbreeCaster]:
    scene = gray_scene(triangles)
    hierarchy = Hierarchy(scene)
    return hierarchy, NodeShapes(hierarchy), EmbreeCaster(scene.triangles, 1)


def linked(triangles: np.ndarray) -> tuple[Hierarchy, NodeShapes, Links, ClusterLinks]:
    hierarchy, shapes, caster = prepared(triangles)
    return hierarchy, shapes, *first_links(hierarchy, shapes, caster, SolverSettings(seed=3), MANY)[:2]


@pytest.fixture(scope="module", params=["room", "sphere"])
def made(request: pytest.FixtureRequest) -> tuple[Hierarchy, NodeShapes, Links, ClusterLinks]:
    return linked(box_room((2, 1, 1), n=5)[0] if request.param == "room" else sphere(3))


def faces_of(hierarchy: Hierarchy, node: int) -> np.ndarray:
    clusters = hierarchy.clusters
    if node >= len(clusters):
        return np.array([node - len(clusters)])
    return clusters.order[clusters.start[node] : clusters.end[node]]


def test_the_mean_of_what_faces_receive_is_the_factor(made) -> None:
    """Mean normal · v = F V, and the gradient adds nothing on the mean over the cluster."""
    hierarchy, _, _, links = made
    assert len(links) > 1000
    mean_normal = hierarchy.clusters.normal[links.receiver]
    carried = np.einsum("lk,lk->l", mean_normal, links.vector) + links.even
    np.testing.assert_allclose(carried, links.factor * links.visibility, rtol=2e-5, atol=1e-8)
    some = links.take(np.array([5]))
    cut = ClusterCut(hierarchy, links.receiver, links.source)
    radiosity = np.ones((hierarchy.n_clusters + hierarchy.n_elements, 1))
    faces = faces_of(hierarchy, int(some.receiver[0]))
    at_faces = gather_at_clusters(hierarchy, cut, some, radiosity)[:, 0]
    mean = np.average(at_faces[faces], weights=hierarchy.faces.area[faces])
    assert mean == pytest.approx(float(some.factor[0] * some.visibility[0]), rel=1e-4)
    assert not np.delete(at_faces, faces).any()


def test_gather_is_the_sum_over_links_and_faces(made) -> None:
    """Each face: (n·v + g·(x − c)) times the source's mean, less g · its mean of (y − c) B."""
    hierarchy, _, _, links = made
    faces, clusters, count = hierarchy.faces, hierarchy.clusters, hierarchy.n_clusters
    radiosity = np.random.default_rng(0).uniform(0, 2, (hierarchy.n_elements, 2))
    nodes = node_radiosity(hierarchy, radiosity)
    expected = np.zeros((len(faces), 2))
    for row in range(len(links)):
        to, of = int(links.receiver[row]), int(links.source[row])
        rows, sent = faces_of(hierarchy, to), faces_of(hierarchy, of)
        slope = links.gradient[row].astype(float)
        weight = faces.normal[rows] @ links.vector[row] + (faces.center[rows] - clusters.center[to]) @ slope
        expected[rows] += weight[:, None] * nodes[of]
        if of < count:
            share = faces.area[sent, None] / clusters.area[of]
            offset = (faces.center[sent] - clusters.center[of]) @ slope
            expected[rows] -= (share * offset[:, None] * radiosity[sent]).sum(axis=0)
    cut = ClusterCut(hierarchy, links.receiver, links.source)
    np.testing.assert_allclose(
        gather_at_clusters(hierarchy, cut, links, nodes), expected, rtol=1e-5, atol=1e-7
    )
    assert not gather_at_clusters(hierarchy, cut, no_cluster_links(), nodes).any()


def exact(hierarchy: Hierarchy, to: np.ndarray, of: np.ndarray, radiosity: np.ndarray) -> np.ndarray:
    """Return what arrives at the centroids of the faces `to` from the faces `of`, by Lambert's formula."""
    faces = hierarchy.faces
    point, normal = np.repeat(faces.center[to], len(of), 0), np.repeat(faces.normal[to], len(of), 0)
    factors = point_to_polygon(point, normal, np.tile(faces.corners[of], (len(to), 1, 1)))
    return np.asarray(factors.reshape(len(to), len(of)) @ radiosity[of])


def errors_of_one_link(size: float) -> tuple[float, float]:
    """Return relative rms errors on the faces of a patch under one of uneven light.

    Of the mean over many seeds, and of a single one about that mean.
    """
    below = rectangle((0, 0, 0), (size, 0, 0), (0, size, 0), 4)
    beside = rectangle((1.0, 0.2, 0.4), (0, 0, size), (0, size, 0), 4)
    hierarchy, shapes, caster = prepared(np.concatenate([below, beside]))
    to, of = (
        next(c for c in range(hierarchy.n_clusters) if set(faces_of(hierarchy, c)) == set(patch))
        for patch in (range(32), range(32, 64))
    )
    rising = 1.0 + (hierarchy.faces.center[:, 2:] - 0.4) / size
    wanted = exact(hierarchy, np.arange(32), np.arange(32, 64), rising[:, 0])
    assert wanted.min() > 0
    got = []
    for seed in range(200):
        links = measure_cluster_links(hierarchy, shapes, caster, np.array([to]), np.array([of]), seed, 1)
        assert links.visibility[0] == 1
        cut = ClusterCut(hierarchy, links.receiver, links.source)
        got.append(gather_at_clusters(hierarchy, cut, links, node_radiosity(hierarchy, rising))[:32, 0])
    mean = np.mean(got, axis=0)
    bias, noise = np.sqrt(((mean - wanted) ** 2).mean()), np.sqrt(((got - mean) ** 2).mean())
    return float(bias / wanted.mean()), float(noise / wanted.mean())


def test_errors_fall_with_the_square_of_the_size() -> None:
    """First order in both places is kept: halving both leaves a quarter of the error, half the noise."""
    (bias, noise), (half_bias, half_noise) = (errors_of_one_link(size) for size in (0.3, 0.15))
    assert bias < 0.03
    assert noise < 0.03
    assert half_bias < 0.33 * bias
    assert half_noise < 0.6 * noise


def test_closed_scenes_are_closed(made) -> None:
    """ΣFV = 1: on the mean within 0.2 %, on every face within 4 %."""
    hierarchy, _, links, together = made
    closure = link_closure(hierarchy, links, together)
    np.testing.assert_allclose(closure, 1.0, atol=0.04)
    mean = float(hierarchy.faces.area @ closure / hierarchy.faces.area.sum())
    assert mean == pytest.approx(1.0, abs=0.002)


def test_every_pair_of_faces_is_linked_once(made) -> None:
    """Over a link of their own or of clusters they are in; or not at all if one is behind the other."""
    hierarchy, _, links, together = made
    count, faces = hierarchy.n_clusters, hierarchy.faces
    held = np.zeros((len(faces),) * 2, dtype=int)
    for receiver, source in zip(links.receiver + count, links.source, strict=True):
        held[np.ix_(faces_of(hierarchy, receiver), faces_of(hierarchy, source))] += 1
    for receiver, source in zip(together.receiver, together.source, strict=True):
        held[np.ix_(faces_of(hierarchy, receiver), faces_of(hierarchy, source))] += 1
    assert held.max() == 1
    rise = np.einsum("ijk,ik->ij", faces.center[None] - faces.center[:, None], faces.normal)
    see = (rise > 1e-3) & (rise.T > 1e-3)
    # Pairs of which no sample faced the other exchange next to nothing.
    assert held[see].mean() > 0.995


def test_links_are_as_small_as_promised(made) -> None:
    hierarchy, shapes, links, together = made
    area = 2e-5 * float(hierarchy.faces.area.sum())
    assert (shapes.cone[together.receiver] <= CONE).all()
    mixed = shapes.cone[together.source] > CONE
    large = shapes.looks_large(together.receiver, together.source, np.where(mixed, MIXED_SIZE, MAX_RADII))
    assert (hierarchy.clusters.area[together.receiver[large]] <= area).all()
    grouped = links.source < hierarchy.n_clusters
    receiver = links.receiver[grouped] + hierarchy.n_clusters
    assert not shapes.looks_large(receiver, links.source[grouped], FACE_SIZE).any()


def test_nothing_is_dropped_that_is_seen(made) -> None:
    """`may_see` is False only where no face of one rises above any of the other."""
    hierarchy, shapes, _, _ = made
    rng = np.random.default_rng(5)
    one, other = rng.integers(0, hierarchy.n_clusters + len(hierarchy.faces), (2, 3000))
    corners, normal, center = hierarchy.faces.corners, hierarchy.faces.normal, hierarchy.faces.center
    dropped = np.flatnonzero(~shapes.may_see(one, other))
    if len(hierarchy.faces) == 512:
        # In a sphere every face sees every other.
        assert len(dropped) == 0
        return
    assert 100 < len(dropped) < 2900
    for pair in dropped[:400]:
        a, b = faces_of(hierarchy, one[pair]), faces_of(hierarchy, other[pair])
        rise = np.einsum("abck,ak->abc", corners[b][None] - center[a][:, None, None], normal[a]).max(axis=2)
        fall = np.einsum("back,bk->abc", corners[a][None] - center[b][:, None, None], normal[b]).max(axis=2)
        assert (np.minimum(rise, fall) <= 1e-5).all()


def test_links_grow_no_faster_than_faces() -> None:
    """Four times the faces: no more than four times the links, and no pairs of all with all."""
    totals = []
    for n in (4, 8, 16):
        _, _, links, together = linked(box_room(n=n)[0])
        totals.append(len(links) + len(together))
    assert totals[1] < 4.5 * totals[0]
    assert totals[2] < 4 * totals[1]
    assert totals[2] < 0.02 * (12 * 16**2) ** 2


def test_threads_do_not_change_a_bit() -> None:
    triangles, _ = box_room((2, 1, 1), n=5)
    hierarchy, shapes, caster = prepared(triangles)
    one, two = (
        first_links(hierarchy, shapes, caster, SolverSettings(threads=threads), MANY)[:2]
        for threads in (1, 2)
    )
    for mine, theirs in zip(one, two, strict=True):
        assert [array.tobytes() for array in vars(mine).values()] == [
            array.tobytes() for array in vars(theirs).values()
        ]


def test_what_looks_all_ways_is_lit_all_around() -> None:
    """A ball linked as a whole to a closed room of B = 1: H is 1 on every side, and turned to a lamp more.

    Half the vector and a quarter of its length are the first two harmonics of max(n·d, 0): all around
    they add up to the true irradiance, where whole vectors would cancel to 0.
    """
    room, _ = box_room((2, 2, 2), n=4)
    ball = 0.1 * sphere(2)[:, ::-1] + 1.0
    triangles = np.concatenate([room, ball])
    emission = gray(len(triangles), 0.0)
    emission[len(room) :] = 1.0  # what shines has a tree of its own
    hierarchy = Hierarchy(gray_scene(triangles, 0.5, emission))
    shapes, caster = NodeShapes(hierarchy), EmbreeCaster(triangles, 1)
    faces = len(room) + np.arange(len(ball))
    of_ball = hierarchy.roots[-1]
    assert set(faces_of(hierarchy, of_ball)) == set(faces)
    walls = hierarchy.n_clusters + np.arange(len(room))
    to = np.full(len(walls), of_ball)
    links = measure_cluster_links(hierarchy, shapes, caster, to, walls, 0, 1)
    assert len(links) == len(walls)
    assert (links.even > 0).all()
    cut = ClusterCut(hierarchy, links.receiver)
    bright = np.ones((hierarchy.n_elements, 2))
    bright[: len(room), 1] = hierarchy.faces.center[: len(room), 2] > 1.99
    got = gather_at_clusters(hierarchy, cut, links, node_radiosity(hierarchy, bright))[faces]
    np.testing.assert_allclose(got[:, 0], 1.0, atol=0.12)
    wanted = exact(hierarchy, faces, np.arange(len(room)), bright[: len(room), 1])
    area = hierarchy.faces.area[faces]
    assert area @ got[:, 1] == pytest.approx(area @ wanted, rel=0.05)
    assert np.sqrt(np.mean((got[:, 1] - wanted) ** 2)) < 0.12 * wanted.max()
    assert np.corrcoef(got[:, 1], wanted)[0, 1] > 0.9
