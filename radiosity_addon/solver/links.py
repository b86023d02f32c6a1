"""Links: which node lights which element, how much, and how sure that is.

A link (receiver r, source s) carries the unoccluded form factor F_rs by formula and the
visibility V_rs by rays, apart. Both are area means. Near pairs get the exact factor, far
ones Lambert's point-to-polygon formula at a few points; clusters are sampled.

Rays join the quarters of the two sides: at first four, one from each quarter to each
quarter; where they disagree all sixteen. Four agreeing rays are no proof, so every link
also carries its *doubt*: how much its F·V may vary or be wrong.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import Array
from .form_factor import point_to_polygon, triangle_to_triangle
from .hierarchy import Hierarchy, split_in_four
from .parallel import for_chunks
from .sampling import hash_keys, points_on_triangles, stratified_square
from .visibility import RayCaster

CHUNK = 1 << 15
"""Pairs measured at once: 16 samples of 48 bytes each bound the temporaries to about 100 MB."""

EXACT_WITHIN = 1.0
"""Pairs nearer than this (distance of centres over the sum of radii) get the exact factor."""


def _symmetric(weight: float) -> list[list[float]]:
    """Return the three barycentric points that give each corner `weight` in turn."""
    rest = 0.5 * (1.0 - weight)
    return [[weight, rest, rest], [rest, weight, rest], [rest, rest, weight]]


_ROOT = 15.0**0.5
RULES = (
    # Radon's seven points, exact to degree 5
    (
        2.5,
        np.array([[1 / 3] * 3, *_symmetric((9 + 2 * _ROOT) / 21), *_symmetric((9 - 2 * _ROOT) / 21)]),
        np.array([9 / 40] + [(155 - _ROOT) / 1200] * 3 + [(155 + _ROOT) / 1200] * 3),
    ),
    # three points, exact to degree 2
    (8.0, np.array(_symmetric(2 / 3)), np.array([1 / 3] * 3)),
    # the centroid, exact to degree 1
    (np.inf, np.array([[1 / 3] * 3]), np.array([1.0])),
)
"""Cubature over the receiver for the others: (up to which ratio, barycentric points, weights)."""


@dataclass(frozen=True)
class Links:
    """l links as arrays.

    Attributes
    ----------
    receiver : (l,) int32
        Element.
    source : (l,) int32
        Node: a cluster, or n_clusters + element.
    factor : (l,) float32
        F_rs, the unoccluded fraction of what leaves the receiver that arrives at the source.
    visibility : (l,) float32
        Share of F_rs that is not blocked.
    doubt : (l,) float32
        Standard deviation of F·V over the samples and what too few rays may have missed.
    to_quarter, of_quarter : (l, 4) float32
        How F·V is shared out over the receiver's and the source's quarters, mean 1 each: so
        leaves below an inner element do not all inherit the same (a cluster's are all 1).
    """

    receiver: Array
    source: Array
    factor: Array
    visibility: Array
    doubt: Array
    to_quarter: Array
    of_quarter: Array

    def __len__(self) -> int:
        return len(self.receiver)

    def take(self, rows: Array) -> Links:
        """Return the links of a boolean mask or of row numbers."""
        return Links(
            self.receiver[rows],
            self.source[rows],
            self.factor[rows],
            self.visibility[rows],
            self.doubt[rows],
            self.to_quarter[rows],
            self.of_quarter[rows],
        )

    def sorted_by_receiver(self) -> Links:
        """Return them in order of receiver, which `transport.gather` needs."""
        return self.take(np.argsort(self.receiver, kind="stable"))


def no_links() -> Links:
    """Return an empty set of links."""
    return join([])


def join(parts: list[Links]) -> Links:
    """Concatenate sets of links."""
    joined = []
    for name, kind, shape in (
        ("receiver", np.int32, (0,)),
        ("source", np.int32, (0,)),
        ("factor", np.float32, (0,)),
        ("visibility", np.float32, (0,)),
        ("doubt", np.float32, (0,)),
        ("to_quarter", np.float32, (0, 4)),
        ("of_quarter", np.float32, (0, 4)),
    ):
        arrays = [getattr(part, name) for part in parts] or [np.zeros(shape)]
        joined.append(np.concatenate(arrays).astype(kind, copy=False))
    return Links(*joined)


def measure_links(
    hierarchy: Hierarchy,
    caster: RayCaster,
    receiver: Array,
    source: Array,
    seed: int,
    threads: int = 0,
) -> Links:
    """Compute factor, visibility and doubt of new links; pairs that face away are left out.

    Parameters
    ----------
    hierarchy : Hierarchy
    caster : RayCaster
    receiver, source : (n,) int
        Elements and nodes.
    seed : int
        Places the samples, together with the pair's own numbers.
    threads : int
        0 means all cores; the links do not depend on it.

    Returns
    -------
    links : Links
        At most n.
    """
    parts: dict[int, Links] = {}

    def measure(rows: slice) -> None:
        parts[rows.start] = _measure_chunk(hierarchy, caster, receiver[rows], source[rows], seed)

    for_chunks(measure, len(receiver), CHUNK, threads)
    return join([parts[start] for start in sorted(parts)])


def _measure_chunk(
    hierarchy: Hierarchy,
    caster: RayCaster,
    receiver: Array,
    source: Array,
    seed: int,
) -> Links:
    is_cluster = source < hierarchy.n_clusters
    factor = np.zeros(len(receiver))
    single = np.flatnonzero(~is_cluster)
    factor[single] = element_factors(hierarchy, receiver[single], source[single] - hierarchy.n_clusters)
    kept = np.flatnonzero(is_cluster | (factor > 0))
    receiver, source, factor, is_cluster = receiver[kept], source[kept], factor[kept], is_cluster[kept]

    samples = _PairSamples(hierarchy, receiver, source, seed)
    transfer = samples.transfer
    factor = np.where(is_cluster, transfer.mean(axis=1), factor)
    traced = np.zeros(transfer.shape, dtype=bool)
    free = np.zeros(transfer.shape, dtype=bool)

    every = np.arange(len(receiver))
    _trace(caster, samples, every, slice(0, 4), traced, free)
    seen = (free[:, :4] & traced[:, :4]).sum(axis=1)
    tried = traced[:, :4].sum(axis=1)
    disagree = np.flatnonzero((seen > 0) & (seen < tried))
    _trace(caster, samples, disagree, slice(4, 16), traced, free)

    weight = np.where(traced, transfer, 0.0)
    total = weight.sum(axis=1)
    lit = (weight * free).sum(axis=1)
    visibility = np.where(total > 0, lit / np.maximum(total, 1e-300), 1.0)
    rays = traced.sum(axis=1)
    # How far F·V varies over the pair, and what so few rays can have missed.
    passed = np.where(traced, transfer * free, 0.0)
    mean = passed.sum(axis=1) / np.maximum(rays, 1)
    square = (passed**2).sum(axis=1) / np.maximum(rays, 1)
    spread = np.sqrt(np.maximum(square - mean**2, 0.0))
    doubt = np.hypot(np.minimum(spread, 1.0), factor / (rays + 2.0))
    links = Links(
        receiver.astype(np.int32),
        source.astype(np.int32),
        factor.astype(np.float32),
        visibility.astype(np.float32),
        doubt.astype(np.float32),
        *_quarter_shares(hierarchy, receiver, source, samples, transfer * (free | ~traced)),
    )
    return links.take(factor > 0)


def _quarter_shares(
    hierarchy: Hierarchy, receiver: Array, source: Array, samples: _PairSamples, passed: Array
) -> tuple[Array, Array]:
    """Share links out over their receiver's and source's quarters: two (n, 4) float32 of mean 1.

    In proportion to Lambert's factor at the quarters' centroids, times what the samples
    of each quarter saw.
    """
    open_to, open_of = samples.by_quarter(samples.transfer)
    seen_to, seen_of = samples.by_quarter(passed)
    shares = np.ones((2, len(receiver), 4))
    single = np.flatnonzero(source >= hierarchy.n_clusters)
    element = source[single] - hierarchy.n_clusters
    for number, (on, toward) in enumerate(((receiver[single], element), (element, receiver[single]))):
        points = split_in_four(hierarchy.corners[on]).mean(axis=2).reshape(-1, 3)
        normals = np.repeat(hierarchy.normal[on], 4, axis=0)
        polygons = np.repeat(hierarchy.corners[toward], 4, axis=0)
        shares[number, single] = point_to_polygon(points, normals, polygons).reshape(-1, 4)
    shares[0] *= np.where(open_to > 0, seen_to / np.maximum(open_to, 1e-300), 1.0)
    shares[1, single] *= np.where(open_of > 0, seen_of / np.maximum(open_of, 1e-300), 1.0)[single]
    mean = shares.mean(axis=2, keepdims=True)
    shares = np.where(mean > 0, shares / np.where(mean > 0, mean, 1.0), 1.0).astype(np.float32)
    return shares[0], shares[1]


def _trace(
    caster: RayCaster,
    samples: _PairSamples,
    rows: Array,
    columns: slice,
    traced: Array,
    free: Array,
) -> None:
    """Trace the samples of some links that carry light, and note the outcome."""
    chosen = np.zeros(traced.shape, dtype=bool)
    chosen[rows, columns] = samples.transfer[rows, columns] > 0
    link, sample = np.nonzero(chosen)
    start = samples.receiver_points[link, sample] + caster.surface_offset * samples.receiver_normals[link]
    end = samples.source_points[link, sample] + caster.surface_offset * samples.source_normals[link, sample]
    along = end - start
    distance = np.linalg.norm(along, axis=1)
    free[link, sample] = caster.visible(start, along / np.maximum(distance, 1e-300)[:, None], distance)
    traced |= chosen


class _PairSamples:
    """Sixteen stratified point pairs of n links and the transfer each stands for.

    transfer : (n, 16), κ(x, y) · A_source, at most 1: what F would be if all were like this pair.
    Columns 0 to 3 already touch every quarter of both sides once.
    """

    def __init__(self, hierarchy: Hierarchy, receiver: Array, source: Array, seed: int) -> None:
        count = len(receiver)
        # Column 4a + q joins the receiver's quarter q to the source's quarter q xor (turn + a).
        pair = receiver.astype(np.int64) << 32 | source.astype(np.int64)
        turn = hash_keys(pair, seed) & 3
        receiver_quarter = np.tile(np.arange(4), 4)
        source_quarter = np.tile(np.arange(4), 4)[None] ^ ((turn[:, None] + np.repeat(np.arange(4), 4)) % 4)
        quarters = split_in_four(hierarchy.corners[receiver])
        jitter = stratified_square(pair, 16, seed + 1)
        self.receiver_points = _one_in_each(quarters[:, receiver_quarter], jitter)
        self.receiver_normals = hierarchy.faces.normal[hierarchy.face[receiver]]

        self.source_points = np.empty((count, 16, 3))
        self.source_normals = np.empty((count, 16, 3))
        jitter = stratified_square(pair, 16, seed + 2)
        along = stratified_square(pair, 16, seed + 3)[..., 0]
        is_cluster = source < hierarchy.n_clusters
        single = np.flatnonzero(~is_cluster)
        element = source[single] - hierarchy.n_clusters
        quarters = split_in_four(hierarchy.corners[element])
        self.source_points[single] = _one_in_each(
            quarters[np.arange(len(single))[:, None], source_quarter[single]], jitter[single]
        )
        self.source_normals[single] = hierarchy.faces.normal[hierarchy.face[element]][:, None]
        grouped = np.flatnonzero(is_cluster)
        share = (source_quarter[grouped] + along[grouped]) / 4.0
        face = sample_clusters(hierarchy, source[grouped], share)
        self.source_points[grouped] = _one_in_each(hierarchy.faces.corners[face], jitter[grouped])
        self.source_normals[grouped] = hierarchy.faces.normal[face]

        area = np.empty(count)
        area[single] = hierarchy.area[element]
        area[grouped] = hierarchy.clusters.area[source[grouped]]
        self._source_quarter = np.where(is_cluster[:, None], -1, source_quarter)
        self.transfer = np.minimum(
            kernel(
                self.receiver_points, self.receiver_normals[:, None], self.source_points, self.source_normals
            )
            * area[:, None],
            1.0,
        )

    def by_quarter(self, values: Array) -> tuple[Array, Array]:
        """Average (n, 16) values over each of the receiver's and the source's quarters: two (n, 4)."""
        to = values.reshape(-1, 4, 4).mean(axis=1)
        of = [np.where(self._source_quarter == q, values, 0.0).sum(axis=1) / 4.0 for q in range(4)]
        return to, np.stack(of, axis=1)


def kernel(
    receiver_points: Array,
    receiver_normals: Array,
    source_points: Array,
    source_normals: Array,
) -> Array:
    """Return κ = G/π = cosθ_r cosθ_s / (π r²) [1/m²] without visibility (handout (2.20), (2.25)).

    All arguments (…, 3), broadcast against each other; 0 where either side faces away.
    """
    along = source_points - receiver_points
    square = np.maximum(np.einsum("...k,...k->...", along, along), 1e-300)
    cos_r = np.maximum(np.einsum("...k,...k->...", along, receiver_normals), 0.0)
    cos_s = np.maximum(-np.einsum("...k,...k->...", along, source_normals), 0.0)
    return np.asarray(cos_r * cos_s / (np.pi * square * square))


def _one_in_each(corners: Array, unit: Array) -> Array:
    """Return (n, k, 3): a point in each of (n, k, 3, 3) triangles, placed by (n, k, 2)."""
    points = points_on_triangles(corners.reshape(-1, 3, 3), unit.reshape(-1, 1, 2))
    return points.reshape(*unit.shape[:2], 3)


def sample_clusters(hierarchy: Hierarchy, cluster: Array, share: Array) -> Array:
    """Return the faces at (n, k) shares in [0, 1) of n clusters' areas."""
    clusters = hierarchy.clusters
    low = clusters.area_before[clusters.start[cluster]][:, None]
    at = low + share * clusters.area[cluster][:, None]
    slot = np.searchsorted(clusters.area_before, at, side="right") - 1
    slot = np.clip(slot, clusters.start[cluster][:, None], clusters.end[cluster][:, None] - 1)
    return np.asarray(clusters.order[slot])


def element_factors(hierarchy: Hierarchy, receiver: Array, source: Array) -> Array:
    """Return the unoccluded form factors F_rs between n pairs of elements (handout (3.27)).

    0 where either lies behind the other. Near pairs are exact, the others Lambert's formula,
    clipped to the receiver's horizon, averaged over the receiver by a cubature rule.
    """
    to, of = hierarchy.corners[receiver], hierarchy.corners[source]
    normal_to, normal_of = hierarchy.normal[receiver], hierarchy.normal[source]
    centre_to, centre_of = to.mean(axis=1), of.mean(axis=1)
    radius_to = np.linalg.norm(to - centre_to[:, None], axis=2).max(axis=1)
    radius_of = np.linalg.norm(of - centre_of[:, None], axis=2).max(axis=1)
    sizes = radius_to + radius_of
    # Exactly behind: no corner of the one rises over the other's plane.
    rise_of = np.einsum("nck,nk->nc", of - centre_to[:, None], normal_to).max(axis=1)
    rise_to = np.einsum("nck,nk->nc", to - centre_of[:, None], normal_of).max(axis=1)
    faces = (rise_of > 1e-9 * sizes) & (rise_to > 1e-9 * sizes)
    ratio = np.linalg.norm(centre_to - centre_of, axis=1) / sizes

    factor = np.zeros(len(receiver))
    near = np.flatnonzero(faces & (ratio < EXACT_WITHIN))
    factor[near] = triangle_to_triangle(to[near], of[near])
    nearest = EXACT_WITHIN
    for farthest, weights, shares in RULES:
        rows = np.flatnonzero(faces & (ratio >= nearest) & (ratio < farthest))
        points = (weights @ to[rows]).reshape(-1, 3)
        repeats = len(weights)
        values = point_to_polygon(
            points, np.repeat(normal_to[rows], repeats, axis=0), np.repeat(of[rows], repeats, axis=0)
        )
        factor[rows] = values.reshape(-1, repeats) @ shares
        nearest = farthest
    return factor
