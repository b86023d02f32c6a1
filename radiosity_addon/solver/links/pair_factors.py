"""Pairs of nodes: their unoccluded form factor by formula, their visibility by rays.

Sixteen stratified point pairs stand for a pair of nodes. Rays join the quarters of the two
sides: at first four, one from each quarter to each quarter; where they disagree all sixteen.
"""

from __future__ import annotations

import numpy as np

from ...form_factors import kernel, point_to_polygon, triangle_to_triangle, visibility_of, weighted_sums
from ...numerics import (
    Array,
    Stream,
    hash_keys,
    pick_in_runs,
    point_on_each_triangle,
    split_in_four,
    stratified_square,
)
from ...rays import RayCaster
from ..hierarchy import Hierarchy

EXACT_WITHIN = 1.0
"""Pairs nearer than this (distance of centers over the sum of radii) get the exact factor."""


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


ALL_SAMPLES, FIRST_SAMPLES = 16, 4


def pair_visibility(
    hierarchy: Hierarchy, caster: RayCaster, receiver: Array, source: Array, seed: int
) -> Array:
    """Return (n,) the visibility V of pairs, as `open_share` of all their samples gives it.

    Most pairs are settled by their first four samples. The others make all sixteen, those
    too of whose first four none faces both ways: taken for open they would leak through walls.
    """
    few = PairSamples(hierarchy, receiver, source, seed, FIRST_SAMPLES)
    visibility = open_share(few, *trace_pairs(caster, few))
    unasked = ~(few.transfer > 0).any(axis=1)
    rows = np.flatnonzero(((visibility > 0) & (visibility < 1)) | unasked)
    many = PairSamples(hierarchy, receiver[rows], source[rows], seed)
    visibility[rows] = open_share(many, *trace_pairs(caster, many, empty_too=True))
    return visibility


def trace_pairs(caster: RayCaster, samples: PairSamples, empty_too: bool = False) -> tuple[Array, Array]:
    """Trace the samples of pairs: four each, all sixteen where those disagree.

    empty_too: All sixteen also where the four carry nothing. Not for links: their error estimate is about
        such pairs, and has them refined.
    Returns traced (n, 16) bool: Which samples were traced.
    Returns free (n, 16): What share of these passes: 0 or 1 where there are no cut-outs.
    """
    traced = np.zeros(samples.transfer.shape, dtype=bool)
    free = np.zeros(samples.transfer.shape)
    every = np.arange(len(traced))
    _trace(caster, samples, every, slice(0, FIRST_SAMPLES), traced, free)
    seen = free[:, :4].sum(axis=1)
    tried = traced[:, :4].sum(axis=1)
    unsettled = np.flatnonzero(((seen > 0) & (seen < tried)) | (empty_too & (tried == 0)))
    _trace(caster, samples, unsettled, slice(FIRST_SAMPLES, ALL_SAMPLES), traced, free)
    return traced, free


def open_share(samples: PairSamples, traced: Array, free: Array) -> Array:
    """Return (n,) the visibility V: the share of the traced samples' transfer that nothing blocks."""
    weight = np.where(traced, samples.transfer, 0.0)
    total = weight.sum(axis=1)
    lit = (weight * free).sum(axis=1)
    return np.where(total > 0, lit / np.maximum(total, 1e-300), 1.0)


def _trace(
    caster: RayCaster,
    samples: PairSamples,
    rows: Array,
    columns: slice,
    traced: Array,
    free: Array,
) -> None:
    """Trace the samples of some links that carry light, and note the outcome."""
    chosen = np.zeros(traced.shape, dtype=bool)
    chosen[rows, columns] = samples.transfer[rows, columns] > 0
    link, sample = np.nonzero(chosen)
    free[link, sample] = visibility_of(
        caster,
        samples.receiver_points[link, sample],
        samples.receiver_normals[link],
        samples.source_points[link, sample],
        samples.source_normals[link, sample],
    )
    traced |= chosen


class PairSamples:
    """Sixteen stratified point pairs of n links and the transfer each stands for.

    transfer : (n, 16), κ(x, y) · A_source, at most 1: what F would be if all were like this pair.
    Columns 0 to 3 already touch every quarter of both sides once; with `samples` = 4 there are
    no others.
    """

    def __init__(
        self,
        hierarchy: Hierarchy,
        receiver: Array,
        source: Array,
        seed: int,
        samples: int = ALL_SAMPLES,
    ) -> None:
        count = len(receiver)
        # Column 4a + q joins the receiver's quarter q to the source's quarter q xor (turn + a).
        pair = receiver.astype(np.int64) << 32 | source.astype(np.int64)
        turn = hash_keys(pair, seed + Stream.PAIR_TURN) & 3
        receiver_quarter = np.tile(np.arange(4), samples // 4)
        turned = turn[:, None] + np.repeat(np.arange(samples // 4), 4)
        source_quarter = receiver_quarter[None] ^ (turned % 4)
        quarters = split_in_four(hierarchy.corners[receiver])
        jitter = stratified_square(pair, samples, seed + Stream.PAIR_RECEIVER)
        self.receiver_points = point_on_each_triangle(quarters[:, receiver_quarter], jitter)
        self.receiver_normals = hierarchy.faces.normal[hierarchy.face[receiver]]

        self.source_points = np.empty((count, samples, 3))
        self.source_normals = np.empty((count, samples, 3))
        jitter = stratified_square(pair, samples, seed + Stream.PAIR_SOURCE)
        along = stratified_square(pair, samples, seed + Stream.PAIR_SOURCE_FACE)[..., 0]
        is_cluster = source < hierarchy.n_clusters
        single = np.flatnonzero(~is_cluster)
        element = source[single] - hierarchy.n_clusters
        quarters = split_in_four(hierarchy.corners[element])
        self.source_points[single] = point_on_each_triangle(
            quarters[np.arange(len(single))[:, None], source_quarter[single]], jitter[single]
        )
        self.source_normals[single] = hierarchy.faces.normal[hierarchy.face[element]][:, None]
        grouped = np.flatnonzero(is_cluster)
        share = (source_quarter[grouped] + along[grouped]) / 4.0
        face = sample_clusters(hierarchy, source[grouped], share)
        self.source_points[grouped] = point_on_each_triangle(hierarchy.faces.corners[face], jitter[grouped])
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
        by_receiver_quarter = values.reshape(-1, 4, 4).mean(axis=1)
        by_source_quarter = [
            np.where(self._source_quarter == q, values, 0.0).sum(axis=1) / 4.0 for q in range(4)
        ]
        return by_receiver_quarter, np.stack(by_source_quarter, axis=1)


def sample_clusters(hierarchy: Hierarchy, cluster: Array, share: Array) -> Array:
    """Return the faces at (n, k) shares in [0, 1) of n clusters' areas."""
    clusters = hierarchy.clusters
    begin, end = clusters.start[cluster][:, None], clusters.end[cluster][:, None]
    slot, _ = pick_in_runs(clusters.area_before, share, begin, end)
    return np.asarray(clusters.order[slot])


def element_factors(hierarchy: Hierarchy, receiver: Array, source: Array) -> Array:
    """Return the unoccluded form factors F_rs between n pairs of elements (handout (3.27)).

    0 where either lies behind the other. Near pairs are exact, the others Lambert's formula,
    clipped to the receiver's horizon, averaged over the receiver by a cubature rule.
    """
    receiver_corners, source_corners = hierarchy.corners[receiver], hierarchy.corners[source]
    receiver_normal, source_normal = (
        hierarchy.faces.normal[hierarchy.face[source_corners]] for source_corners in (receiver, source)
    )
    receiver_center, source_center = receiver_corners.mean(axis=1), source_corners.mean(axis=1)
    receiver_radius = np.linalg.norm(receiver_corners - receiver_center[:, None], axis=2).max(axis=1)
    source_radius = np.linalg.norm(source_corners - source_center[:, None], axis=2).max(axis=1)
    sizes = receiver_radius + source_radius
    # Exactly behind: no corner of the one rises over the other's plane.
    rise_of = np.einsum("nck,nk->nc", source_corners - receiver_center[:, None], receiver_normal).max(axis=1)
    rise_to = np.einsum("nck,nk->nc", receiver_corners - source_center[:, None], source_normal).max(axis=1)
    faces = (rise_of > 1e-9 * sizes) & (rise_to > 1e-9 * sizes)
    ratio = np.linalg.norm(receiver_center - source_center, axis=1) / sizes

    factor = np.zeros(len(receiver))
    near = np.flatnonzero(faces & (ratio < EXACT_WITHIN))
    factor[near] = triangle_to_triangle(receiver_corners[near], source_corners[near])
    nearest = EXACT_WITHIN
    for farthest, weights, shares in RULES:
        rows = np.flatnonzero(faces & (ratio >= nearest) & (ratio < farthest))
        points = (weights @ receiver_corners[rows]).reshape(-1, 3)
        repeats = len(weights)
        values = point_to_polygon(
            points,
            np.repeat(receiver_normal[rows], repeats, axis=0),
            np.repeat(source_corners[rows], repeats, axis=0),
        )
        factor[rows] = weighted_sums(values.reshape(-1, repeats), shares)
        nearest = farthest
    return factor
