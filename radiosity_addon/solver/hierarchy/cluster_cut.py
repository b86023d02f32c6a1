"""A cut through the cluster tree at the lowest linked clusters.

In a scene of a million faces most links end at clusters of hundreds of faces. Below the nodes of the
cut nothing has to be added up cluster by cluster, so sums upward and pushes downward cost
little more than one pass over the faces, however deep the tree is.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array
from .nodes import Hierarchy


class ClusterCut:
    """The clusters that are linked, those above them, and the nodes of the cut, which tile all faces.

    linked (n,) int arrays: Nodes; elements among them do not matter.
    row (c,) int32: Row of each cluster that is linked or above a linked one; −1 elsewhere.
    n_rows: Of the `n_inner` clusters above the cut first, then of its nodes.
    nodes (k,) int64: The cut's.
    row_of_face (f,) int32: Row of the cut's node that each face lies in.
    """

    def __init__(self, hierarchy: Hierarchy, *linked: Array) -> None:
        clusters = hierarchy.clusters
        self._clusters, self._area = clusters, hierarchy.faces.area
        self.kept: object = None
        """Cache for data derived from links to these clusters."""
        count, n_faces = len(clusters), len(hierarchy.faces)
        used = np.zeros(count + n_faces, dtype=bool)
        for nodes in linked:
            used[nodes[nodes < count]] = True
        opened = np.zeros(count, dtype=bool)
        for level in reversed(clusters.levels):
            opened[level] = used[clusters.children[level]].any(axis=1)
            used[level] |= opened[level]
        inner = np.flatnonzero(opened)
        self.n_inner = len(inner)
        # The cut's nodes tile the order of the faces: each is known by the first slot of its run.
        slot = np.empty(count + n_faces, dtype=np.int64)
        slot[:count] = clusters.start
        slot[count + clusters.order] = np.arange(n_faces)
        nodes = np.concatenate([hierarchy.roots, clusters.children[inner].ravel()])
        nodes = nodes[(nodes >= count) | ~opened[np.minimum(nodes, max(count - 1, 0))]] if count else nodes
        nodes = nodes[np.argsort(slot[nodes], kind="stable")]
        self.nodes, self._start = nodes, slot[nodes]
        self.n_rows = self.n_inner + len(nodes)
        row = np.full(count + n_faces, -1, dtype=np.int32)
        row[inner] = np.arange(self.n_inner)
        row[nodes] = np.arange(self.n_inner, self.n_rows)
        self.row = row[:count]
        self._children = row[clusters.children[inner]]
        bounds = np.searchsorted(inner, [level.stop for level in clusters.levels]).tolist()
        self._levels = [slice(a, b) for a, b in zip([0, *bounds], bounds, strict=False) if b > a]
        length = np.diff(self._start, append=n_faces)
        self.row_of_face = np.empty(n_faces, dtype=np.int32)
        rows = np.arange(self.n_inner, self.n_rows, dtype=np.int32)
        self.row_of_face[clusters.order] = np.repeat(rows, length)

    def sums(self, values: Array) -> Array:
        """Return (n_rows, k): the sums of (f, k) face values, children first.

        Never as differences of one running sum: in those the rounding of the large faces
        would drown clusters of tiny ones.
        """
        order = self._clusters.order
        columns = [np.ascontiguousarray(values[:, column]).take(order) for column in range(values.shape[1])]
        return self.sums_of(columns)

    def sums_of(self, columns: list[Array]) -> Array:
        """Return the same of columns (f,) in the order of the clusters' faces."""
        total = np.zeros((self.n_rows, len(columns)))
        if not len(self._area):
            return total
        for column, ordered in enumerate(columns):
            total[self.n_inner :, column] = np.add.reduceat(ordered, self._start)
        for level in reversed(self._levels):
            children = self._children[level]
            total[level] = total[children[:, 0]] + total[children[:, 1]]
        return total

    def means(self, values: Array) -> Array:
        """Return (c, k): the area means of (f, k) face values; 0 where a cluster has no row."""
        result = np.zeros((len(self._clusters), values.shape[1]))
        held = np.flatnonzero(self.row >= 0)
        sums = self.sums(values * self._area[:, None])[self.row[held]]
        result[held] = sums / self._clusters.area[held, None]
        return result

    def push(self, values: Array) -> Array:
        """Return (n_rows, k): the values of every row plus those of all clusters above it."""
        total = values.copy()
        for level in self._levels:
            total[self._children[level]] += total[level][:, None]
        return total

    def rows(self, clusters: Array) -> Array:
        """Return (n,) int64: the rows of linked clusters, for `spread`."""
        return self.row[clusters].astype(np.int64)

    def spread(self, rows: Array, weights: Array) -> Array:
        """Return (n_rows,): the `weights` of links added up at the `rows` of their clusters."""
        return np.bincount(rows, weights, self.n_rows)
