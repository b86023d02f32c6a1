"""Measuring links to clusters: vector and gradient of the transfer, and its visibility.

Far pairs are sampled: stratified point pairs give the mean of the kernel without the
receiver's cosine, as a vector, and of the kernel's derivative. Where the two sides nearly
touch samples would scatter wildly; there Lambert's formula, summed over the source's faces,
is evaluated at points of the receiver, and a plane is fitted to the results.

Receivers that look many ways are linked only where they exchange hardly anything. What such
faces receive is no plane of their normal n: over all directions max(n·d, 0) is nearest to
1/4 + n·d/2 (its first two spherical harmonics: Ramamoorthi and Hanrahan 2001), so half the
vector is kept, and the rest of the mean goes to all faces evenly.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...form_factors import point_to_polygon, visibility_of
from ...numerics import Array, Stream, hash_keys, map_chunks, run_numbers
from ...rays import RayCaster
from ..hierarchy import Hierarchy, NodeShapes
from .cluster_links import ClusterLinks, join_cluster_links
from .node_sampling import node_area, node_samples

CHUNK_SAMPLES = 1 << 18
"""Point pairs measured at once: bounds the temporaries to about 100 MB a thread."""

FAR_SAMPLES, NEAR_SAMPLES = 16, 64
FIRST_RAYS = 4

NEAR_RADII = 0.9
"""Pairs whose radii together exceed this part of their distance are near."""

MOST_FACES = 64
"""A near source of more faces is sampled too, without a gradient: such pairs are linked only in clutter,
where evaluating them face by face would be too slow."""


def measure_cluster_links(
    hierarchy: Hierarchy,
    shapes: NodeShapes,
    caster: RayCaster,
    receiver: Array,
    source: Array,
    seed: int,
    threads: int = 0,
    progress: Progress = SILENT,
) -> ClusterLinks:
    """Compute links to clusters; pairs whose fronts do not see each other are left out.

    receiver, source (n,) int: Clusters and nodes.
    Returns links: At most n.
    """
    near = shapes.looks_large(receiver, source, NEAR_RADII)
    wide = shapes.cone[receiver] > MAX_SPREAD
    many = near & ((_held(hierarchy, source) > MOST_FACES) | wide)
    result: list[ClusterLinks] = []
    for kind, chosen in (
        ("far", ~near & ~wide),
        ("wide", ~near & wide),
        ("near", near & ~many),
        ("many", many & ~wide),
        ("wide and many", many & wide),
    ):
        rows = np.flatnonzero(chosen)
        samples = FAR_SAMPLES if kind in ("far", "wide") else NEAR_SAMPLES
        measure = partial(
            _links_of_kind, hierarchy, caster, receiver[rows], source[rows], kind, samples, seed
        )
        chunks = map_chunks(measure, len(rows), CHUNK_SAMPLES // samples, threads, progress)
        result += [links for _, links in chunks]
    return join_cluster_links(result)


MAX_SPREAD = 1.0
"""Faces of which some are turned further than this from their mean [rad] look many ways: on the far side
of such a cluster n·v is below 0, and would eat up what arrives there from elsewhere."""

LEAST_SQUARE = 0.01
"""Of a mean normal: faces that look different ways may have next to none to go by."""


def _links_of_kind(
    hierarchy: Hierarchy,
    caster: RayCaster,
    receiver: Array,
    source: Array,
    kind: str,
    samples: int,
    seed: int,
    rows: slice,
) -> ClusterLinks:
    return _ClusterPairs(hierarchy, receiver[rows], source[rows], samples, seed).links(caster, kind)


class _ClusterPairs:
    """Stratified point pairs of n pairs of a cluster and a node, those that face each other."""

    def __init__(self, hierarchy: Hierarchy, receiver: Array, source: Array, samples: int, seed: int) -> None:
        self.hierarchy = hierarchy
        pair = receiver.astype(np.int64) << 32 | source.astype(np.int64)
        turn = hash_keys(pair, seed + Stream.CLUSTER_PAIR_TURN) & 3
        # Column 4a + q joins the receiver's quarter q to the source's quarter q xor (turn + a).
        column = np.arange(samples)
        to_quarter = np.broadcast_to(column % 4, (len(pair), samples))
        of_quarter = to_quarter ^ ((turn[:, None] + column // 4) % 4)
        of_receiver = Stream.CLUSTER_PAIR_RECEIVER, Stream.CLUSTER_PAIR_RECEIVER_FACE
        of_source = Stream.CLUSTER_PAIR_SOURCE, Stream.CLUSTER_PAIR_SOURCE_FACE
        x, n_x = node_samples(hierarchy, receiver, to_quarter, pair, seed, of_receiver)
        y, n_y = node_samples(hierarchy, source, of_quarter, pair, seed, of_source)
        along = y - x
        rise_x = np.einsum("nsk,nsk->ns", along, n_x)
        rise_y = -np.einsum("nsk,nsk->ns", along, n_y)
        faces = (rise_x > 0) & (rise_y > 0)
        kept = np.flatnonzero(faces.any(axis=1))
        self.receiver, self.source, self.faces = receiver[kept], source[kept], faces[kept]
        self.x, self.n_x, self.y, self.n_y = x[kept], n_x[kept], y[kept], n_y[kept]
        self.along, self.rise_x, self.rise_y = along[kept], rise_x[kept], rise_y[kept]
        self.square = np.maximum(np.einsum("nsk,nsk->ns", self.along, self.along), 1e-300)
        self.area = node_area(hierarchy, self.source)[:, None]

    def links(self, caster: RayCaster, kind: str) -> ClusterLinks:
        """Return the links of the pairs that exchange light.

        All are "far" or "near", or "wide" of a receiver that looks many ways; "many" are near ones
        whose sources have too many faces to be evaluated one by one.
        """
        # A sample stands for its share of the source as a disk: bounded however near (Wallace et al. 1989).
        own_disk = 0.0 if kind in ("far", "wide") else self.area / self.faces.shape[1]
        bounded = self.area / (self.square * (np.pi * self.square + own_disk))
        scale = np.where(self.faces, bounded, 0.0)
        transfer = scale * self.rise_x * self.rise_y
        mean = transfer.mean(axis=1)
        mean_normal = self.hierarchy.clusters.normal[self.receiver]
        even = np.zeros(len(mean))
        if kind == "near":
            vector, gradient = self._exact()
        elif "wide" in kind:
            toward = bounded * np.maximum(self.rise_y, 0.0)
            vector = 0.5 * np.einsum("ns,nsk->nk", toward, self.along) / toward.shape[1]
            gradient = np.zeros_like(vector)
            even = mean - np.einsum("nk,nk->n", mean_normal, vector)
        else:
            vector, gradient = self._sampled(scale, transfer)
            if kind == "many":
                # Samples that nearly touch have no usable derivative.
                gradient = np.zeros_like(gradient)
            # Where position and normal are correlated, n·v at their means is not the mean of the transfer.
            lacking = mean - np.einsum("nk,nk->n", mean_normal, vector)
            squared = np.maximum(np.einsum("nk,nk->n", mean_normal, mean_normal), LEAST_SQUARE)
            vector += mean_normal * (lacking / squared)[:, None]
        factor = np.maximum(even + np.einsum("nk,nk->n", mean_normal, vector), 0.0)
        traced, free = self._trace(caster, transfer)
        weight = np.where(traced, transfer, 0.0)
        total = weight.sum(axis=1)
        visibility = np.where(total > 0, (weight * free).sum(axis=1) / np.maximum(total, 1e-300), 1.0)
        links = ClusterLinks(
            self.receiver.astype(np.int32),
            self.source.astype(np.int32),
            factor.astype(np.float32),
            visibility.astype(np.float32),
            _doubt(transfer, traced, free, factor).astype(np.float32),
            (vector * visibility[:, None]).astype(np.float32),
            (gradient * visibility[:, None]).astype(np.float32),
            (even * visibility).astype(np.float32),
        )
        return links.take(factor > 0)

    def _sampled(self, scale: Array, transfer: Array) -> tuple[Array, Array]:
        """Return (n, 3) means of the vector transfer and of the derivative of the transfer.

        t = A a p / (π r⁴) with p = n·d, a = −n_s·d, d = y − x, so
        ∂t/∂x = A / (π r⁴) (p n_s − a n + 4 a p d / r²).
        """
        samples = scale.shape[1]
        toward = scale * self.rise_y
        vector = np.einsum("ns,nsk->nk", toward, self.along) / samples
        gradient = np.einsum("ns,nsk->nk", scale * self.rise_x, self.n_y)
        gradient -= np.einsum("ns,nsk->nk", toward, self.n_x)
        gradient += np.einsum("ns,nsk->nk", 4.0 * transfer / self.square, self.along)
        return vector, gradient / samples

    def _exact(self) -> tuple[Array, Array]:
        """Fit n·v + g·(x − c), v along the mean normal, to Lambert's factors at a few points."""
        clusters = self.hierarchy.clusters
        few = slice(0, FAR_SAMPLES)
        values = self._lambert(self.x[:, few], self.n_x[:, few])
        mean = values.mean(axis=1)
        offset = self.x[:, few] - self.x[:, few].mean(axis=1, keepdims=True)
        normal = np.einsum("nsi,nsj->nij", offset, offset)
        # Across a flat cluster nothing varies: a little of the unit matrix keeps that direction at 0.
        ridge = 1e-3 * FAR_SAMPLES * clusters.radius[self.receiver] ** 2
        normal += ridge[:, None, None] * np.eye(3)
        right = np.einsum("nsi,ns->ni", offset, values - mean[:, None])
        gradient = np.linalg.solve(normal, right[..., None])[..., 0]
        direction = clusters.normal[self.receiver]
        squared = np.maximum(np.einsum("nk,nk->n", direction, direction), LEAST_SQUARE)
        return direction * (mean / squared)[:, None], gradient

    def _lambert(self, points: Array, normals: Array) -> Array:
        """Return (n, k) unoccluded factors from points to all faces of the sources."""
        hierarchy, clusters, count = self.hierarchy, self.hierarchy.clusters, self.hierarchy.n_clusters
        single = self.source >= count
        cluster = np.where(single, 0, self.source)
        held = _held(hierarchy, self.source)
        row = np.repeat(np.arange(len(self.source)), held)
        slot = run_numbers(held, clusters.start[cluster])
        corners = hierarchy.faces.corners[clusters.order[np.minimum(slot, len(clusters.order) - 1)]]
        corners[single[row]] = hierarchy.corners[self.source[row[single[row]]] - count]
        values = np.empty(points.shape[:2])
        for column in range(points.shape[1]):
            factor = point_to_polygon(points[row, column], normals[row, column], corners)
            values[:, column] = np.bincount(row, factor, len(self.source))
        return values

    def _trace(self, caster: RayCaster, transfer: Array) -> tuple[Array, Array]:
        """Trace the first samples of every pair, and all where those disagree: (n, s) bool and float."""
        traced, free = np.zeros(transfer.shape, dtype=bool), np.zeros(transfer.shape)
        rows = np.arange(len(transfer))
        for columns in (slice(0, FIRST_RAYS), slice(FIRST_RAYS, transfer.shape[1])):
            chosen = np.zeros(transfer.shape, dtype=bool)
            chosen[rows, columns] = transfer[rows, columns] > 0
            at = np.nonzero(chosen)
            free[at] = visibility_of(caster, self.x[at], self.n_x[at], self.y[at], self.n_y[at])
            traced |= chosen
            seen, tried = free.sum(axis=1), traced.sum(axis=1)
            # Nothing traced yet: the first samples face away from each other, others do not.
            rows = np.flatnonzero((tried == 0) | ((seen > 0) & (seen < tried)))
        return traced, free


def _held(hierarchy: Hierarchy, nodes: Array) -> Array:
    """Return (n,) the number of faces of nodes."""
    clusters = hierarchy.clusters
    cluster = np.where(nodes < hierarchy.n_clusters, nodes, 0)
    return np.where(nodes < hierarchy.n_clusters, (clusters.end - clusters.start)[cluster], 1)


def _doubt(transfer: Array, traced: Array, free: Array, factor: Array) -> Array:
    """Return (n,) the variation of F·V over the samples, combined with what few rays can have missed."""
    rays = traced.sum(axis=1)
    passed = np.where(traced, transfer * free, 0.0)
    mean = passed.sum(axis=1) / np.maximum(rays, 1)
    square = (passed**2).sum(axis=1) / np.maximum(rays, 1)
    spread = np.sqrt(np.maximum(square - mean**2, 0.0))
    return np.asarray(np.hypot(np.minimum(spread, 1.0), factor / (rays + 2.0)))
