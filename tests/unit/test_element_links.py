"""Links: form factors by formula, visibility by rays, and how they are shared out over quarters."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.form_factors.formulas import triangle_to_triangle
from radiosity_addon.form_factors.geometry_kernel import kernel
from radiosity_addon.numerics.triangles import split_in_four
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from radiosity_addon.solver.links import element_links
from radiosity_addon.solver.links.element_links import Links, join, measure_links, no_links
from radiosity_addon.solver.links.pair_factors import element_factors
from tests.rooms import box_room, gray_scene, rectangle, solid_box


def hierarchy_of(triangles: np.ndarray) -> tuple[Hierarchy, EmbreeCaster]:
    return Hierarchy(gray_scene(triangles)), EmbreeCaster(triangles)


def random_rotations(rng: np.random.Generator, count: int) -> np.ndarray:
    turns = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    return turns * np.sign(np.linalg.det(turns))[:, None, None]


def pairs_at(ratio: float, count: int = 300) -> np.ndarray:
    """Return (2 count, 3, 3): random pairs whose centers are `ratio` times their radii apart."""
    rng = np.random.default_rng(int(10 * ratio))
    shapes = rng.normal(size=(2 * count, 3, 3))
    shapes -= shapes.mean(axis=1, keepdims=True)
    radius = np.linalg.norm(shapes, axis=2).max(axis=1)
    away = np.einsum("nij,j->ni", random_rotations(rng, count), np.array([1.0, 0, 0]))
    shapes[1::2] += (ratio * (radius[::2] + radius[1::2]))[:, None, None] * away[:, None]
    return shapes


def measure(hierarchy: Hierarchy, caster: EmbreeCaster, receiver: list, source: list, seed: int = 0) -> Links:
    """Measure links between elements."""
    return measure_links(
        hierarchy, caster, np.asarray(receiver), np.asarray(source) + hierarchy.n_clusters, seed
    )


# --- factors ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("ratio", "largest", "bias"),
    [(0.5, 0.0, 1e-12), (0.99, 0.0, 1e-12), (1.01, 5e-3, 2e-4), (2.0, 3e-4, 1e-5), (2.6, 1e-3, 5e-5),
     (5.0, 5e-5, 3e-6), (8.1, 3e-4, 1e-5), (20.0, 1e-5, 5e-7)],
)  # fmt: skip
def test_element_factors_at_every_distance(ratio: float, largest: float, bias: float) -> None:
    """Near pairs exactly as the outline integral; the others within the cubature's error, without bias."""
    triangles = pairs_at(ratio)
    hierarchy, _ = hierarchy_of(triangles)
    there = np.arange(0, len(triangles), 2)
    factor = element_factors(hierarchy, there, there + 1)
    exact = triangle_to_triangle(triangles[there], triangles[there + 1])
    assert (exact > 0).sum() > 30
    np.testing.assert_allclose(factor, exact, atol=largest + 1e-15)
    assert factor.mean() == pytest.approx(exact.mean(), abs=bias)


def test_pairs_that_face_away_have_no_factor_and_no_link() -> None:
    below = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    above = rectangle((0, 0, 1), (0, 1, 0), (1, 0, 0))
    beside = rectangle((3, 0, 0), (1, 0, 0), (0, 1, 0))
    triangles = np.concatenate([below, above, above[:, ::-1] + np.array([0, 0, 0.5]), beside])
    hierarchy, caster = hierarchy_of(triangles)
    receiver, source = (axis.ravel() for axis in np.meshgrid(np.arange(8), np.arange(8), indexing="ij"))
    exact = triangle_to_triangle(triangles[receiver], triangles[source])
    factor = element_factors(hierarchy, receiver, source)
    np.testing.assert_array_equal(factor > 0, exact > 0)
    made = measure(hierarchy, caster, receiver, source)
    assert {(r, s - hierarchy.n_clusters) for r, s in zip(made.receiver, made.source, strict=True)} == set(
        zip(receiver[exact > 0].tolist(), source[exact > 0].tolist(), strict=True)
    )
    assert (made.factor > 0).all()


def test_kernel_is_lamberts() -> None:
    """κ = cosθ cosθ' / (π r²); 0 where either faces away."""
    up, down = np.array([0, 0, 1.0]), np.array([0, 0, -1.0])
    origin = np.zeros(3)
    assert kernel(origin, up, np.array([0, 0, 2.0]), down) == pytest.approx(1 / (4 * np.pi))
    assert kernel(origin, up, np.array([3.0, 0, 4.0]), down) == pytest.approx(0.8**2 / (25 * np.pi))
    for normals in ((down, down), (up, up), (down, up)):
        assert kernel(origin, normals[0], np.array([0, 0, 2.0]), normals[1]) == 0


def test_factors_to_a_cluster_are_those_to_its_faces_together() -> None:
    """Sixteen samples a link: without bias over receivers that look at it from some way off."""
    rng = np.random.default_rng(5)
    far = rectangle((-6, -6, -6), (12, 0, 0), (0, 12, 0), n=10)
    blob = rng.uniform(-0.5, 0.5, (12, 1, 3)) + 0.1 * rng.normal(size=(12, 3, 3))
    triangles = np.concatenate([far, blob])
    hierarchy, caster = hierarchy_of(triangles)
    clusters = hierarchy.clusters
    runs = [set(clusters.order[s:e].tolist()) for s, e in zip(clusters.start, clusters.end, strict=True)]
    wanted = set(range(len(far), len(triangles)))
    cluster = min((c for c, run in enumerate(runs) if wanted <= run), key=lambda c: len(runs[c]))
    members = np.array(sorted(runs[cluster]))
    receiver = np.setdiff1d(np.arange(len(far)), members)
    exact = triangle_to_triangle(
        triangles[np.repeat(receiver, len(members))], triangles[np.tile(members, len(receiver))]
    )
    source = np.full(len(receiver), cluster)
    sums = [measure_links(hierarchy, caster, receiver, source, seed).factor.sum() for seed in range(20)]
    assert np.mean(sums) == pytest.approx(exact.sum(), rel=0.03)


# --- visibility -------------------------------------------------------------------------------

RECEIVER = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))[:1]
SOURCE = rectangle((0, 0, 2), (0, 1, 0), (1, 0, 0))[:1]


def occluded(*occluders: np.ndarray, seed: int = 0) -> Links:
    """Measure the two links between RECEIVER and SOURCE."""
    triangles = np.concatenate([RECEIVER, SOURCE, *occluders])
    return measure(*hierarchy_of(triangles), [0, 1], [1, 0], seed)


def test_visibility_without_and_behind_an_occluder() -> None:
    assert occluded().visibility.tolist() == [1, 1]
    wall = rectangle((-1, -1, 1), (3, 0, 0), (0, 3, 0))
    for side in (wall, wall[:, ::-1]):
        assert occluded(side).visibility.tolist() == [0, 0]
    assert occluded(wall + np.array([5, 0, 0])).visibility.tolist() == [1, 1]


def half_wall(edge: float) -> np.ndarray:
    return rectangle((edge, -5, 1), (20, 0, 0), (0, 20, 0))


@pytest.mark.parametrize("edge", [0.3, 0.45, 0.6])
def test_visibility_past_half_a_wall(edge: float) -> None:
    """The plane at half height hides what a dense quadrature says; sixteen rays where the first disagree."""
    weights = np.random.default_rng(1).dirichlet(np.ones(3), (2, 40000))
    below, above = weights[0] @ RECEIVER[0], weights[1] @ SOURCE[0]
    transfer = kernel(below, np.array([0, 0, 1.0]), above, np.array([0, 0, -1.0]))
    expected = transfer @ (0.5 * (below + above)[:, 0] < edge) / transfer.sum()
    assert 0.1 < expected < 0.9
    seen = np.array([occluded(half_wall(edge), seed=seed).visibility for seed in range(40)])
    partial = (seen > 0) & (seen < 1)
    assert partial.mean() > 0.4
    assert np.abs(seen[partial] - expected).max() < 0.25
    # Links that stop at four agreeing rays push the mean a little away from a half.
    assert seen.mean() == pytest.approx(expected, abs=0.06)


def test_error_estimate_is_larger_where_rays_disagree_and_never_nothing() -> None:
    """Four agreeing rays are no proof."""
    free, half = occluded(), occluded(half_wall(0.45))
    assert ((half.visibility > 0) & (half.visibility < 1)).all()
    assert (half.error_estimate > 1.5 * free.error_estimate).all()
    assert (free.error_estimate >= free.factor / 6).all()
    hidden = occluded(rectangle((-1, -1, 1), (3, 0, 0), (0, 3, 0)))
    np.testing.assert_allclose(hidden.error_estimate, hidden.factor / 6, rtol=1e-6)


def test_closed_convex_room_sees_itself_whole() -> None:
    triangles, _ = box_room((1, 2, 0.7), n=2)
    hierarchy, caster = hierarchy_of(triangles)
    count = len(triangles)
    made = measure(hierarchy, caster, np.repeat(np.arange(count), count), np.tile(np.arange(count), count))
    assert (made.visibility == 1).all()
    sums = np.bincount(made.receiver, made.factor, count)
    np.testing.assert_allclose(sums, 1.0, atol=2e-3)


# --- quarters ---------------------------------------------------------------------------------


def cluttered() -> tuple[Hierarchy, EmbreeCaster, np.ndarray, np.ndarray]:
    """A room with a box in it, and all pairs of its nodes."""
    room, _ = box_room((3, 2, 2))
    triangles = np.concatenate([room, solid_box((0.5, 0.5, 0.0), (1.2, 1.2, 1.0))])
    hierarchy, caster = hierarchy_of(triangles)
    receiver = np.repeat(np.arange(24), hierarchy.n_clusters + 24)
    source = np.tile(np.arange(hierarchy.n_clusters + 24), 24)
    return hierarchy, caster, receiver, source


def test_shares_of_quarters_have_mean_one_and_are_not_negative() -> None:
    hierarchy, caster, receiver, source = cluttered()
    made = measure_links(hierarchy, caster, receiver, source, seed=2)
    for shares in (made.to_quarter, made.of_quarter):
        np.testing.assert_allclose(shares.mean(axis=1), 1.0, atol=1e-6)
        assert (shares >= 0).all()
    grouped = made.source < hierarchy.n_clusters
    assert grouped.any()
    assert (made.of_quarter[grouped] == 1).all()
    assert ((made.visibility >= 0) & (made.visibility <= 1)).all()


def test_shares_are_the_factors_of_the_quarters() -> None:
    """Unoccluded, and some way off, quarter by quarter as the exact factors."""
    triangles = np.concatenate([RECEIVER, SOURCE + np.array([0.8, 0.3, 0])])
    made = measure(*hierarchy_of(triangles), [0, 1], [1, 0])
    for row, (on, toward) in enumerate(((0, 1), (1, 0))):
        quarters = split_in_four(triangles[on : on + 1])[0]
        exact = triangle_to_triangle(quarters, np.repeat(triangles[toward : toward + 1], 4, axis=0))
        np.testing.assert_allclose(made.to_quarter[row], exact / exact.mean(), rtol=0.02)
        # Reciprocity: what a source's quarters send to the receiver.
        np.testing.assert_allclose(made.of_quarter[1 - row], exact / exact.mean(), rtol=0.02)


def test_a_hidden_quarter_has_a_small_share() -> None:
    """A plate just above the receiver's corner 0 covers that quarter and no other."""
    plate = rectangle((-0.1, -0.4, 0.01), (0.605, 0, 0), (0, 0.905, 0))
    made = occluded(plate)
    corners = split_in_four(RECEIVER)[0].mean(axis=1)
    covered = int(np.flatnonzero((corners[:, 0] < 0.45) & (corners[:, 1] < 0.45))[0])
    for to, of in ((made.to_quarter[0], made.of_quarter[1]),):
        for shares in (to, of):
            assert shares[covered] < 0.4
            assert np.delete(shares, covered).min() > 1.0


# --- bookkeeping ------------------------------------------------------------------------------


def as_bytes(made: Links) -> list[bytes]:
    assert made.tint is None  # no glass
    return [getattr(made, name).tobytes() for name in Links.__dataclass_fields__ if name != "tint"]


def test_chunks_order_and_company_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A link depends on its pair and the seed alone."""
    hierarchy, caster, receiver, source = cluttered()
    whole = measure_links(hierarchy, caster, receiver, source, seed=3)
    assert as_bytes(measure_links(hierarchy, caster, receiver, source, seed=3)) == as_bytes(whole)
    assert as_bytes(measure_links(hierarchy, caster, receiver, source, seed=4)) != as_bytes(whole)
    monkeypatch.setattr(element_links, "CHUNK", 57)
    assert as_bytes(measure_links(hierarchy, caster, receiver, source, seed=3)) == as_bytes(whole)
    order = np.random.default_rng(0).permutation(len(receiver))
    mixed = measure_links(hierarchy, caster, receiver[order], source[order], seed=3)
    sort = [np.lexsort((made.source, made.receiver)) for made in (whole, mixed)]
    assert as_bytes(mixed.take(sort[1])) == as_bytes(whole.take(sort[0]))


def test_join_take_and_sort_keep_the_rows_together() -> None:
    hierarchy, caster, receiver, source = cluttered()
    made = measure_links(hierarchy, caster, receiver, source, seed=3)
    assert len(no_links()) == 0
    assert as_bytes(join([made, no_links()])) == as_bytes(made)
    halves = [made.take(np.arange(0, len(made), 2)), made.take(np.arange(len(made)) % 2 == 1)]
    again = join(halves[::-1]).sorted_by_receiver()
    assert (np.diff(again.receiver) >= 0).all()
    key = np.lexsort((again.source, again.receiver))
    assert as_bytes(again.take(key)) == as_bytes(made.take(np.lexsort((made.source, made.receiver))))


def test_no_pairs_no_links() -> None:
    hierarchy, caster, _, _ = cluttered()
    none = np.zeros(0, dtype=np.int64)
    made = measure_links(hierarchy, caster, none, none, seed=0)
    assert len(made) == 0
    assert made.to_quarter.shape == (0, 4)
