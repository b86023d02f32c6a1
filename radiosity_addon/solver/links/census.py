"""Number of elements and links per level, for the report."""

from __future__ import annotations

import numpy as np

from ...numerics import Array
from ..hierarchy import Hierarchy
from .cluster_links import ClusterLinks
from .element_links import Links

CLUSTER = -1
"""The level of a source that is a cluster."""


def elements_by_level(hierarchy: Hierarchy) -> list[int]:
    """Return the number of elements per level, including inner ones; level 0 are the faces."""
    return [int(count) for count in np.bincount(hierarchy.level)]


def leaves_by_level(hierarchy: Hierarchy) -> list[int]:
    """Return the number of leaves per level."""
    deepest = int(hierarchy.level.max(initial=0))
    return [int(count) for count in np.bincount(hierarchy.level[hierarchy.leaves], minlength=deepest + 1)]


def links_by_level(hierarchy: Hierarchy, receiver: Array, source: Array) -> list[dict[str, int]]:
    """Return the number of links by the levels they join.

    receiver (l,) int: Elements.
    source (l,) int: Nodes.
    Returns counts list of {"receiver_level", "source_level", "links"}: The pairs of levels that have links,
        in order; a cluster's level is −1.
    """
    of_node = np.full(hierarchy.n_clusters + hierarchy.n_elements, CLUSTER)
    of_node[hierarchy.n_clusters :] = hierarchy.level
    levels = np.stack([hierarchy.level[receiver], of_node[source]], axis=1)
    pairs, counts = np.unique(levels.reshape(-1, 2), axis=0, return_counts=True)
    return [
        {"receiver_level": int(receiver_level), "source_level": int(source_level), "links": int(count)}
        for (receiver_level, source_level), count in zip(pairs, counts, strict=True)
    ]


def linked_leaves(hierarchy: Hierarchy, links: Links, cluster_links: ClusterLinks) -> int:
    """Count the leaf elements: the lowest nodes that receive light over links.

    Clusters that receive as wholes count once; faces with links of their own count by their leaves.
    """
    clusters, count, faces = hierarchy.clusters, hierarchy.n_clusters, len(hierarchy.faces)
    receives = np.zeros(count + faces, dtype=bool)
    receives[cluster_links.receiver] = True
    receives[count + hierarchy.face[links.receiver]] = True
    below = np.zeros(count, dtype=bool)
    for level in reversed(clusters.levels):
        child = clusters.children[level]
        below[level] = receives[child].any(axis=1)
        below[level] |= (below[np.minimum(child, count - 1)] & (child < count)).any(axis=1)
    leaves = np.bincount(hierarchy.face[hierarchy.leaves], minlength=faces)
    return int((receives[:count] & ~below).sum() + leaves[receives[count:]].sum())
