"""Which links to refine, and on which side (handout §4.2.1, Oracle2, weighed by doubt)."""

from __future__ import annotations

import numpy as np

from .hierarchy import LEAF, Hierarchy
from .links import Links
from .transport import node_radiosity, pull


BIAS = 8.0
"""Power misplaced by a source's own variation counts this many times: it does not average out."""


def misplaced_power(hierarchy: Hierarchy, links: Links, radiosity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Estimate the power each link may misplace [W], by cause; the largest channel.

    The handout's Oracle2 compares the whole power B_s A_r F_rs with BF_ε. Weighed by its
    doubt, how much F·V varies or is unknown over the link, a large but certain transfer
    stays coarse. What the link gets wrong because F·V and B vary together over the source
    (a leaf near the receiver is brighter and sees more of it) has the same sign everywhere
    and is weighed higher.

    Parameters
    ----------
    radiosity : (e, 3) float64

    Returns
    -------
    spread : (l,) float64
        B_s · A_r · doubt. A source without radiosity gives 0 and is tested again every round.
    bias : (l,) float64
        σ(B_s) · A_r · doubt, times BIAS: the source should be split.
    """
    brightest = node_radiosity(hierarchy, radiosity).max(axis=1, initial=0.0)
    varying = node_deviation(hierarchy, radiosity)
    uncertain = hierarchy.area[links.receiver] * links.doubt
    return np.asarray(brightest[links.source] * uncertain), np.asarray(BIAS * varying[links.source] * uncertain)


def node_deviation(hierarchy: Hierarchy, radiosity: np.ndarray) -> np.ndarray:
    """Return (n_nodes,) the standard deviation of the radiosity over each node's leaves [W/m²]."""
    mean = node_radiosity(hierarchy, radiosity)
    square = node_radiosity(hierarchy, pull(hierarchy, radiosity**2))
    return np.asarray(np.sqrt(np.maximum(square - mean**2, 0.0)).max(axis=1, initial=0.0))


def choose_side(
    hierarchy: Hierarchy, links: Links, prefer_source: np.ndarray, min_area: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Decide how each link would be refined.

    Clusters open first; otherwise the source splits where it is preferred, else the larger
    side, as the link varies most over it; the other one where that may not get children.

    Returns
    -------
    open_source, split_source, split_receiver : (l,) bool
        At most one is true per link; none where both sides are too small.
    """
    open_source = links.source < hierarchy.n_clusters
    element = np.where(open_source, 0, links.source - hierarchy.n_clusters)
    source_area = hierarchy.area[element]
    receiver_area = hierarchy.area[links.receiver]
    # Subdiv: "has children or may get them".
    source_may = ~open_source & (
        (hierarchy.first_child[element] != LEAF) | (source_area >= 4 * min_area)
    )
    receiver_may = ~open_source & (
        (hierarchy.first_child[links.receiver] != LEAF) | (receiver_area >= 4 * min_area)
    )
    split_receiver = receiver_may & (((receiver_area >= source_area) & ~prefer_source) | ~source_may)
    return open_source, source_may & ~split_receiver, split_receiver


def children_of_links(
    hierarchy: Hierarchy, links: Links, prefer_source: np.ndarray, min_area: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Replace links by links to or from their children (handout §4.2.1, RefineLink).

    Elements that have none yet get children. A link whose two sides are too small is not
    replaced (the handout's listing would lose it).

    Returns
    -------
    receiver, source : (n,) int
        The new pairs.
    replaced : (l,) bool
    """
    open_source, split_source, split_receiver = choose_side(hierarchy, links, prefer_source, min_area)
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
