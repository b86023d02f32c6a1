"""Transport of light over the links: gather, push-pull and the residual (handout §4.2)."""

from __future__ import annotations

import numpy as np

from ...numerics import Array
from ..hierarchy import LEAF, ClusterCut, Hierarchy
from .element_links import Links


def gather(
    hierarchy: Hierarchy,
    links: Links,
    radiosity: Array,
    scale: Array | None = None,
    cut: ClusterCut | None = None,
    shared: tuple[Array, Array] | None = None,
) -> Array:
    """Collect the irradiance that arrives over each element's own links.

    H_r = Σ_s F_rs V_rs B_s over the links of receiver r (handout §4.2, Gather), distributed
    over the receiver's quarters. Where the source has children, B_s is the mean over its
    quarters by the link's shares.

    links: Sorted by receiver.
    radiosity (e, k): Of the leaves [W/m²]; other rows do not count.
    scale (e, 2): What each leaf's radiosity is multiplied with over its own links, and in its ancestors'
        means (`conservation`).
    cut: With all clusters of the links, if it is at hand.
    shared (e, k), (n_nodes, k): Means by `shared_means`, if they are at hand. The second is overwritten.
    Returns irradiance (e, 4, k): Each element's own share on its four quarters [W/m²]; `push` adds its
        ancestors'.
    """
    channels = radiosity.shape[1]
    irradiance = np.zeros((hierarchy.n_elements, 4, channels))
    if len(links) == 0:
        return irradiance
    first = np.flatnonzero(np.diff(links.receiver, prepend=-1))
    receivers = links.receiver[first]
    scale = np.ones((len(radiosity), 2)) if scale is None else scale
    means, nodes = shared_means(hierarchy, radiosity, scale, cut) if shared is None else shared
    leaves = hierarchy.leaves
    nodes[hierarchy.n_clusters + leaves] = scale[leaves, :1] * radiosity[leaves]
    element = links.source.astype(np.int64) - hierarchy.n_clusters
    inner = np.flatnonzero(element >= 0)
    inner = inner[hierarchy.first_child[element[inner]] != LEAF]
    children = hierarchy.first_child[element[inner]].astype(np.int64)
    split = hierarchy.first_child[receivers] != LEAF
    weight = links.factor * links.visibility
    for channel in range(channels):
        arriving = nodes[links.source, channel]
        arriving[inner] = 0.0
        for quarter in range(4):
            arriving[inner] += 0.25 * links.of_quarter[inner, quarter] * means[children + quarter, channel]
        arriving *= weight
        if links.tint is not None and channels > 1:  # one channel is none of light's
            arriving *= links.tint[:, channel]
        irradiance[receivers, :, channel] = np.add.reduceat(arriving, first)[:, None]
        for quarter in range(4):
            share = np.add.reduceat(arriving * links.to_quarter[:, quarter], first)
            irradiance[receivers[split], quarter, channel] = share[split]
    return irradiance


def shared_means(
    hierarchy: Hierarchy, radiosity: Array, scale: Array | None = None, cut: ClusterCut | None = None
) -> tuple[Array, Array]:
    """Return radiosities for links to coarse sources: means of elements (e, k) and all nodes (n_nodes, k)."""
    means = pull(hierarchy, radiosity if scale is None else scale[:, 1:] * radiosity)
    return means, node_radiosity(hierarchy, means, cut)


def push(hierarchy: Hierarchy, own: Array) -> Array:
    """Add to every element what its ancestors receive; radiosity is per area, so no factors.

    own (e, 4, k): On the quarters of each element; child q inherits quarter q.
    Returns total (e, k): Meaningful at the leaves.
    """
    mean = quarters_mean(own)
    levels = inner_by_level(hierarchy)
    if not levels:
        return mean
    inherited = np.zeros((len(own), own.shape[2]))
    for parents in levels:
        children = hierarchy.first_child[parents][:, None] + np.arange(4)
        inherited[children] = inherited[parents][:, None] + own[parents]
    mean += inherited
    return mean


def quarters_mean(values: Array) -> Array:
    """Return (e, k) the mean of (e, 4, k) values; NumPy's own takes many times longer."""
    mean = np.asarray(values[:, 0] + values[:, 1], dtype=np.float64)
    mean += values[:, 2]
    mean += values[:, 3]
    mean *= 0.25
    return mean


def pull(hierarchy: Hierarchy, at_leaves: Array) -> Array:
    """Average the leaves' values upward; the four children of an element have equal areas.

    at_leaves (e, k): Only the leaves' rows count.
    Returns everywhere (e, k).
    """
    return _pull_in_place(hierarchy, at_leaves.copy())


def _pull_in_place(hierarchy: Hierarchy, values: Array) -> Array:
    for parents in reversed(inner_by_level(hierarchy)):
        children = hierarchy.first_child[parents][:, None] + np.arange(4)
        values[parents] = values[children].mean(axis=1)
    return values


def push_pull(
    hierarchy: Hierarchy,
    lights: Array,
    gathered: Array,
    emission: Array,
    reflectance: Array,
) -> tuple[Array, Array]:
    """Push irradiance to the leaves, reflect it there, and pull radiosity up (handout §4.2).

    lights (e, 3): What the leaves get straight from lamps [W/m²].
    gathered (e, 3): What the leaves got over links, their ancestors' included [W/m²].
    emission, reflectance (e, 3).
    Returns irradiance (e, 3): Area means over the leaves below every element.
    Returns radiosity (e, 3).
    """
    irradiance = lights + gathered
    radiosity = reflectance * irradiance
    radiosity += emission
    return _pull_in_place(hierarchy, irradiance), _pull_in_place(hierarchy, radiosity)


def inner_by_level(hierarchy: Hierarchy) -> list[Array]:
    """Return the elements with children, the coarsest level first."""
    inner = np.flatnonzero(hierarchy.first_child != LEAF)
    level = hierarchy.level[inner]
    return [inner[level == depth] for depth in range(int(level.max(initial=-1)) + 1)]


def node_radiosity(hierarchy: Hierarchy, radiosity: Array, cut: ClusterCut | None = None) -> Array:
    """Put the clusters' area means, those in `cut` at least, above the elements' radiosity: (n_nodes, 3)."""
    of_faces = radiosity[: len(hierarchy.faces)]
    if cut is None:
        clusters = hierarchy.clusters.average(of_faces, hierarchy.faces.area)
    else:
        clusters = cut.means(of_faces)
    return np.concatenate([clusters, radiosity])
