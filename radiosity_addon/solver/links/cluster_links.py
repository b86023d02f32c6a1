"""Links to clusters: many small faces receive together, each by its own normal and position.

The faces of a cluster look much the same way and see the same sources, but not equally. So
such a link carries a vector v and a gradient g in place of one number: a face with normal n
at x receives (n·v + g·(x − c)) B over it, c the cluster's centroid. Vectors and gradients of
all links of a cluster, and of the clusters above it, are added up before the faces are evaluated.

The kernel depends on the difference of the two points, so its derivative by the source's
point is −g: a source whose faces y are not equally bright sends g·(c_s − y) B more, on the
mean over them. Without that a wall that is brighter far up would light the floor too much.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial

import numpy as np

from ...numerics import Array, fill_chunks
from ...scene import Faces
from ..hierarchy import ClusterCut, Hierarchy

TERMS = 7
"""Coefficients of a cluster's light: linear in a face's normal and position, and a constant."""

CHUNK = 1 << 14
"""Faces processed at once: some 3 MB, in the processor's cache."""


@dataclass(frozen=True)
class ClusterLinks:
    """l links to clusters as arrays, in any order.

    receiver (l,) int32: Cluster.
    source (l,) int32: Node: a cluster, or n_clusters + element.
    factor (l,) float32: Unoccluded form factor, the area mean over the cluster's faces.
    visibility, error_estimate (l,) float32: As for `Links`.
    vector (l, 3) float32: v, visibility included: h and the cluster's mean normal times v make factor ·
        visibility.
    gradient (l, 3) float32: g [1/m], visibility included.
    even (l,) float32: h, visibility included: the light that a face receives in any orientation; 0 unless the
        receiver's faces look many ways.
    """

    STORED = ("receiver", "source", "vector", "gradient", "even")

    receiver: Array
    source: Array
    factor: Array
    visibility: Array
    error_estimate: Array
    vector: Array
    gradient: Array
    even: Array

    def __len__(self) -> int:
        return len(self.receiver)

    def take(self, rows: Array) -> ClusterLinks:
        """Return the links of a boolean mask or of row numbers."""
        return ClusterLinks(*(getattr(self, field.name)[rows] for field in fields(self)))


def no_cluster_links() -> ClusterLinks:
    """Return an empty set of links."""
    index, number, vector = np.zeros(0, np.int32), np.zeros(0, np.float32), np.zeros((0, 3), np.float32)
    return ClusterLinks(index, index, number, number, number, vector, vector, number)


def join_cluster_links(parts: list[ClusterLinks]) -> ClusterLinks:
    """Concatenate sets of links."""
    parts = [no_cluster_links(), *parts]
    return ClusterLinks(
        *(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(ClusterLinks))
    )


def gather_at_clusters(
    hierarchy: Hierarchy, cut: ClusterCut, links: ClusterLinks, radiosity: Array, threads: int = 1
) -> Array:
    """Collect the light that arrives over links to clusters, and push it down to the faces.

    cut: With all clusters of the links. It keeps what the same links need again.
    radiosity (n_nodes, k): Of every node, the means of clusters included [W/m²].
    threads: 0 means all cores.
    Returns irradiance (f, k) [W/m²]: Linear in the radiosity; below 0 where a face looks past the horizon of
        what the others see.
    """
    if len(links) == 0:
        return np.zeros((len(hierarchy.faces), radiosity.shape[1]))
    kept = cut.kept
    if not isinstance(kept, _ClusterGather) or kept.links is not links:
        kept = cut.kept = _ClusterGather(hierarchy, cut, links)
    return kept(radiosity, threads)


class _ClusterGather:
    """Links to clusters in the order of their receivers, with all data that does not depend on the light."""

    def __init__(self, hierarchy: Hierarchy, cut: ClusterCut, links: ClusterLinks) -> None:
        clusters, faces = hierarchy.clusters, hierarchy.faces
        self.links, self._cut, self._faces = links, cut, faces
        row = cut.row[links.receiver]
        order = np.argsort(row, kind="stable")
        row = row[order]
        self._rows, self._first = _runs(row)
        self._source = links.source[order]
        # n·v + g·x + h − g·c: linear in (n, x, 1), so seven numbers a cluster and channel.
        constant = links.even - np.einsum("lk,lk->l", links.gradient, clusters.center[links.receiver])
        weights = [*links.vector.T, *links.gradient.T, constant]
        self._weights = [np.ascontiguousarray(weight[order]) for weight in weights]
        grouped = np.flatnonzero(self._source < len(clusters))
        self._slope = [weight[grouped] for weight in self._weights[3:6]]
        self._source_row = cut.row[self._source[grouped]]
        self._slanted_rows, self._slanted_first = _runs(row[grouped])
        self._held = np.flatnonzero(cut.row >= 0)
        self._held_row = cut.row[self._held]
        self._area, self._center = clusters.area[self._held, None], clusters.center[self._held]
        self._first_face = len(clusters)
        self._face_order = clusters.order
        self._arm = [(faces.area * along)[self._face_order] for along in faces.center.T]

    def __call__(self, radiosity: Array, threads: int) -> Array:
        """Return (f, k): see `gather_at_clusters`."""
        channels = radiosity.shape[1]
        at_rows = np.zeros((self._cut.n_rows, channels, TERMS))
        for channel in range(channels):
            of_nodes = np.ascontiguousarray(radiosity[:, channel])
            sent = of_nodes.take(self._source)
            for term, weight in enumerate(self._weights):
                at_rows[self._rows, channel, term] = np.add.reduceat(weight * sent, self._first)
            if len(self._source_row):
                moment = self._moments(of_nodes)
                slanted = sum(
                    slope * along.take(self._source_row)
                    for slope, along in zip(self._slope, moment, strict=True)
                )
                at_rows[self._slanted_rows, channel, 6] -= np.add.reduceat(slanted, self._slanted_first)
        pushed = self._cut.push(at_rows.reshape(-1, channels * TERMS))
        irradiance = np.empty((len(self._faces), channels))
        arrive = partial(_arriving, self._faces, pushed, self._cut.row_of_face)
        fill_chunks(arrive, irradiance, len(irradiance), CHUNK, threads)
        return irradiance

    def _moments(self, radiosity: Array) -> list[Array]:
        """Return 3 × (n_rows,) each cluster's mean of (y − c) B over its faces [W/m], of nodes' radiosity."""
        sent = radiosity[self._first_face :].take(self._face_order)
        sums = self._cut.sums_of([sent * arm for arm in self._arm])[self._held_row]
        moment = np.zeros((self._cut.n_rows, 3))
        moment[self._held_row] = sums / self._area - self._center * radiosity[self._held, None]
        return [np.ascontiguousarray(along) for along in moment.T]


def _arriving(faces: Faces, pushed: Array, row_of_face: Array, rows: slice) -> Array:
    """Return (r, k) what arrives at faces by the terms of their clusters."""
    basis = np.ones((rows.stop - rows.start, TERMS))
    basis[:, :3], basis[:, 3:6] = faces.normal[rows], faces.center[rows]
    terms = pushed.take(row_of_face[rows], axis=0).reshape(len(basis), -1, TERMS)
    return np.einsum("fct,ft->fc", terms, basis)


def _runs(sorted_rows: Array) -> tuple[Array, Array]:
    """Return the distinct numbers of a sorted list, and where each begins."""
    first = np.flatnonzero(np.diff(sorted_rows, prepend=-1))
    return sorted_rows[first], first
