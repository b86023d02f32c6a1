"""Links to clusters: many small faces receive together, each by its own normal and place.

The faces of a cluster look much the same way and see the same sources, but not equally. So
such a link carries a vector v and a gradient g in place of one number: a face with normal n
at x receives (n·v + g·(x − c)) B over it, c the cluster's centroid. Vectors and gradients of
all links of a cluster, and of the clusters above it, add up before the faces are asked.

The kernel depends on the difference of the two points, so its derivative by the source's
point is −g: a source whose faces y are not equally bright sends g·(c_s − y) B more, on the
mean over them. Without that a wall that is brighter far up would light the floor too much.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from .arrays import Array
from .hierarchy import Hierarchy
from .tree_top import TreeTop


@dataclass(frozen=True)
class ClusterLinks:
    """l links to clusters as arrays, in any order.

    Attributes
    ----------
    receiver : (l,) int32
        Cluster.
    source : (l,) int32
        Node: a cluster, or n_clusters + element.
    factor : (l,) float32
        Unoccluded form factor, the area mean over the cluster's faces.
    visibility, doubt : (l,) float32
        As for `Links`.
    vector : (l, 3) float32
        v, visibility included: h and the cluster's mean normal times v make factor · visibility.
    gradient : (l, 3) float32
        g [1/m], visibility included.
    even : (l,) float32
        h, visibility included: what a face receives whichever way it looks; 0 unless the
        receiver's faces look many ways.
    """

    receiver: Array
    source: Array
    factor: Array
    visibility: Array
    doubt: Array
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


def gather_at_clusters(hierarchy: Hierarchy, top: TreeTop, links: ClusterLinks, radiosity: Array) -> Array:
    """Collect what arrives over links to clusters, and push it down to the faces.

    Parameters
    ----------
    top : TreeTop
        With all clusters of the links.
    radiosity : (n_nodes, k) float64
        Of every node, the means of clusters included [W/m²].

    Returns
    -------
    irradiance : (f, k) float64 [W/m²]
        Linear in the radiosity; below 0 where a face looks past the horizon of what the others see.
    """
    irradiance = np.zeros((len(hierarchy.faces), radiosity.shape[1]))
    if len(links) == 0:
        return irradiance
    clusters, faces = hierarchy.clusters, hierarchy.faces
    # n·v + g·x + h − g·c: linear in (n, x, 1), so seven numbers a cluster and channel.
    constant = links.even - np.einsum("lk,lk->l", links.gradient, clusters.centre[links.receiver])
    weights = [*links.vector.T, *links.gradient.T, constant]
    basis = [*faces.normal.T, *faces.centre.T, np.ones(1)]
    of_cluster = np.flatnonzero(links.source < len(clusters))
    slope, source = links.gradient[of_cluster], links.source[of_cluster]
    for channel in range(radiosity.shape[1]):
        sent = radiosity[links.source, channel]
        at_rows = np.stack([top.spread(links.receiver, weight * sent) for weight in weights], axis=1)
        moment = _moments(hierarchy, top, radiosity[:, channel])
        slanted = np.einsum("lk,lk->l", slope, moment[top.row[source]])
        at_rows[:, 6] -= top.spread(links.receiver[of_cluster], slanted)
        for term, pushed in zip(basis, top.push(at_rows).T, strict=True):
            irradiance[:, channel] += term * pushed[top.tip]
    return irradiance


def _moments(hierarchy: Hierarchy, top: TreeTop, radiosity: Array) -> Array:
    """Return (n_rows, 3) each cluster's mean of (y − c) B over its faces [W/m], of (n_nodes,) radiosity."""
    clusters, faces = hierarchy.clusters, hierarchy.faces
    held = np.flatnonzero(top.row >= 0)
    sent = radiosity[len(clusters) :][: len(faces)] * faces.area
    moment = np.zeros((top.n_rows, 3))
    rows = top.row[held]
    moment[rows] = top.sums(sent[:, None] * faces.centre)[rows] / clusters.area[held, None]
    moment[rows] -= clusters.centre[held] * radiosity[held, None]
    return moment
