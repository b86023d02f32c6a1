"""Selects links to refine, and the side (handout §4.2.1, Oracle2, weighted by error estimate)."""

from __future__ import annotations

import numpy as np

from ...numerics import Array
from ..hierarchy import LEAF, ClusterCut, Hierarchy
from .cluster_links import ClusterLinks
from .element_links import Links
from .transport import node_radiosity


def misplaced_power(
    hierarchy: Hierarchy, links: Links, radiosity: Array, cut: ClusterCut | None = None
) -> Array:
    """Estimate the power each link may misplace [W]: B_s · A_r · error estimate, the largest channel.

    The handout's Oracle2 compares the whole power B_s A_r F_rs with BF_ε. Weighed by its
    error estimate, how much F·V varies or is unknown over the link, a large but certain transfer
    stays coarse. A source without radiosity gives 0 and is tested again every round.

    radiosity (e, 3).
    """
    brightest = node_radiosity(hierarchy, radiosity, cut).max(axis=1, initial=0.0)
    return np.asarray(brightest[links.source] * hierarchy.area[links.receiver] * links.error_estimate)


def misplaced_at_clusters(
    hierarchy: Hierarchy, links: ClusterLinks, radiosity: Array, cut: ClusterCut | None = None
) -> Array:
    """Estimate the power each link to a cluster may misplace [W] (see `misplaced_power`)."""
    brightest = node_radiosity(hierarchy, radiosity, cut).max(axis=1, initial=0.0)
    return np.asarray(
        brightest[links.source] * hierarchy.clusters.area[links.receiver] * links.error_estimate
    )


def choose_side(hierarchy: Hierarchy, links: Links, min_area: float) -> tuple[Array, Array, Array]:
    """Decide how each link would be refined.

    Clusters open first; otherwise the larger side splits, as the link varies most over it,
    or the other one where the larger may not get children.

    Returns open_source, split_source, split_receiver (l,) bool: At most one is true per link; none where both
        sides are too small.
    """
    open_source = links.source < hierarchy.n_clusters
    element = np.where(open_source, 0, links.source - hierarchy.n_clusters)
    source_area = hierarchy.area[element]
    receiver_area = hierarchy.area[links.receiver]
    # Subdiv: "has children or may get them".
    source_may = ~open_source & ((hierarchy.first_child[element] != LEAF) | (source_area >= 4 * min_area))
    receiver_may = ~open_source & (
        (hierarchy.first_child[links.receiver] != LEAF) | (receiver_area >= 4 * min_area)
    )
    split_receiver = receiver_may & ((receiver_area >= source_area) | ~source_may)
    return open_source, source_may & ~split_receiver, split_receiver


def children_of_links(hierarchy: Hierarchy, links: Links, min_area: float) -> tuple[Array, Array, Array]:
    """Replace links by links to or from their children (handout §4.2.1, RefineLink).

    Elements that have none yet get children. A link whose two sides are too small is not
    replaced (the handout's listing would lose it).

    Returns receiver, source (n,) int: The new pairs.
    Returns replaced (l,) bool.
    """
    open_source, split_source, split_receiver = choose_side(hierarchy, links, min_area)
    n_clusters = hierarchy.n_clusters
    parents = np.unique(
        np.concatenate([links.source[split_source] - n_clusters, links.receiver[split_receiver]])
    )
    hierarchy.subdivide(parents[hierarchy.first_child[parents] == LEAF])

    quarters = np.arange(4)
    opened = hierarchy.clusters.children[links.source[open_source]]
    of_source = hierarchy.first_child[links.source[split_source] - n_clusters][:, None] + quarters
    of_receiver = hierarchy.first_child[links.receiver[split_receiver]][:, None] + quarters
    receiver = np.concatenate(
        [
            np.repeat(links.receiver[open_source], 2),
            np.repeat(links.receiver[split_source], 4),
            of_receiver.ravel(),
        ]
    )
    source = np.concatenate(
        [
            opened.ravel(),
            n_clusters + of_source.ravel(),
            np.repeat(links.source[split_receiver], 4),
        ]
    )
    return receiver, source, open_source | split_source | split_receiver


def children_of_cluster_links(hierarchy: Hierarchy, links: ClusterLinks) -> tuple[Array, Array]:
    """Replace links to clusters by links to or from the two children of their larger cluster.

    Returns receiver, source (n,) int: The new pairs, both of them nodes.
    """
    clusters, count = hierarchy.clusters, hierarchy.n_clusters
    of_cluster = links.source < count
    source_area = np.where(of_cluster, clusters.area[np.where(of_cluster, links.source, 0)], 0.0)
    opens_source = source_area > clusters.area[links.receiver]
    opened, source = links.receiver[~opens_source], links.source[~opens_source]
    return (
        np.concatenate([np.repeat(links.receiver[opens_source], 2), clusters.children[opened].ravel()]),
        np.concatenate([clusters.children[links.source[opens_source]].ravel(), np.repeat(source, 2)]),
    )
