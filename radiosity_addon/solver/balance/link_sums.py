"""Sums of what leaves send over their own links and over those they share, and of what faces receive.

A leaf hears the links of its ancestors and of the clusters above it besides its own, and is heard
over theirs. Both sums are 1 where nothing escapes, if the links are right (`conservation`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...numerics import Array
from ..hierarchy import LEAF, ClusterCut, Hierarchy
from ..links import ClusterLinks, Links, gather, gather_at_clusters, node_radiosity, pull, push, quarters_mean


class ClusterLinkLight:
    """Light that the receivers of links to clusters take, times opacity, per unit of the source's radiosity.

    power (l,): Σ A_f a_f (n_f·v + g·(x_f − c) + h) over the receiver's faces [m²].
    area (l,): Σ A_f a_f [m²]
    """

    def __init__(self, hierarchy: Hierarchy, cut: ClusterCut, links: ClusterLinks) -> None:
        clusters, faces = hierarchy.clusters, hierarchy.faces
        if (hierarchy.opacity == 1.0).all():
            self.area = clusters.area[links.receiver]
            self.power = self.area * links.factor * links.visibility
            return
        channels = []
        for opacity, tint in _opacity_of_channels(hierarchy, links.tint):
            weight = (opacity[: len(faces)] * faces.area)[:, None]
            sums = cut.sums(np.concatenate([weight, weight * faces.normal, weight * faces.center], axis=1))
            at = sums[cut.row[links.receiver]]
            offset = at[:, 4:] - at[:, :1] * clusters.center[links.receiver]
            power = at[:, 0] * links.even + np.einsum("lk,lk->l", at[:, 1:4], links.vector)
            power += np.einsum("lk,lk->l", offset, links.gradient)
            channels.append((tint * at[:, 0], tint * power))
        self.area, self.power = _mean_of(channels)


def sent_by_leaves(
    hierarchy: Hierarchy, cut: ClusterCut, links: Links, cluster_links: ClusterLinks
) -> tuple[Array, Array]:
    """Return the shares of leaves' light that own links, and those of ancestors and clusters, carry.

    Returns own, shared (e,): Of the leaves; other rows mean nothing.
    """
    at_links = taken_at_links(hierarchy, links)
    sums = sent(hierarchy, links, at_links)
    own = quarters_mean(sums)[:, 0]
    at_clusters = ClusterLinkLight(hierarchy, cut, cluster_links)
    sums = sums + sent_to_clusters(hierarchy, cluster_links, at_clusters)
    from_clusters = _from_clusters(hierarchy, cut, links, at_links, cluster_links, at_clusters)
    return own, push(hierarchy, sums + from_clusters)[:, 0] - own


def received_by_faces(
    hierarchy: Hierarchy, cut: ClusterCut, links: Links, cluster_links: ClusterLinks, scale: Array
) -> Array:
    """Return (f,) ΣFV over each face's, its elements' and its clusters' links, sources scaled by `scale`."""
    # Of colors the mean: what passes glass is relative to what it finds behind it.
    gathered = push(hierarchy, gather(hierarchy, links, hierarchy.opacity_by_channel, scale, cut))
    received = pull(hierarchy, gathered.mean(axis=1, keepdims=True))[: len(hierarchy.faces), 0]
    if len(cluster_links):
        means = node_radiosity(hierarchy, pull(hierarchy, scale[:, 1:] * hierarchy.opacity_by_channel), cut)
        over_clusters = gather_at_clusters(hierarchy, cut, cluster_links, means).mean(axis=1)
        received += np.maximum(over_clusters, 0.0)
    return np.asarray(received)


def _from_clusters(
    hierarchy: Hierarchy,
    cut: ClusterCut,
    links: Links,
    at_links: Array,
    cluster_links: ClusterLinks,
    arriving: ClusterLinkLight,
) -> Array:
    """Return (e, 4, 1) the share that the links of the clusters above each face carry."""
    clusters, faces, count = hierarchy.clusters, hierarchy.faces, hierarchy.n_clusters
    total = np.zeros((hierarchy.n_elements, 4, 1))
    if count == 0:
        return total
    # Linear in the face's place: (1, y) times four numbers a cluster, as `gather_at_clusters` sends.
    share = np.zeros((cut.n_rows, 4))
    grouped = np.flatnonzero(links.source < count)
    source = links.source[grouped]
    share[:, 0] += cut.spread(cut.rows(source), at_links[grouped] / clusters.area[source])
    grouped = np.flatnonzero(cluster_links.source < count)
    source = cluster_links.source[grouped]
    slope = (arriving.area[grouped] / clusters.area[source])[:, None] * cluster_links.gradient[grouped]
    rows = cut.rows(source)
    evenly = arriving.power[grouped] / clusters.area[source]
    evenly += np.einsum("lk,lk->l", slope, clusters.center[source])
    share[:, 0] += cut.spread(rows, evenly)
    for axis in range(3):
        share[:, 1 + axis] -= cut.spread(rows, slope[:, axis])
    carried = np.zeros(len(faces))
    for term, pushed in zip((np.ones(1), *faces.center.T), cut.push(share).T, strict=True):
        carried += term * pushed[cut.row_of_face]
    total[: len(faces)] = np.maximum(carried, 0.0)[:, None, None]
    return total


def sent_to_clusters(hierarchy: Hierarchy, links: ClusterLinks, arriving: ClusterLinkLight) -> Array:
    """Return (e, 1, 1): the share of the light of each element that its own links to clusters carry."""
    single = links.source >= hierarchy.n_clusters
    element = links.source[single] - hierarchy.n_clusters
    power = arriving.power[single]
    return np.bincount(element, power / hierarchy.area[element], hierarchy.n_elements)[:, None, None]


def taken_at_links(hierarchy: Hierarchy, links: Links) -> Array:
    """Return (l,) A_r F_rs V_rs [m²] of links to elements, with A_r the opaque area of the receiver."""
    child = hierarchy.first_child[links.receiver]
    inner = np.flatnonzero(child != LEAF)
    channels = []
    for opacity, tint in _opacity_of_channels(hierarchy, links.tint):
        share = opacity[links.receiver]
        # Quarters take unequal parts of what arrives, and may be covered: each is weighted by what it takes.
        share[inner] = 0.0
        for quarter in range(4):
            share[inner] += 0.25 * links.to_quarter[inner, quarter] * opacity[child[inner] + quarter]
        channels.append((tint * share,))
    (share,) = _mean_of(channels)
    return np.asarray(hierarchy.area[links.receiver] * share * links.factor * links.visibility)


def _opacity_of_channels(hierarchy: Hierarchy, tint: Array | None) -> list[tuple[Array, Array | float]]:
    """Return opacities (e,) and the tints (l,) of links, of each channel; of gray light one pair."""
    opacity = hierarchy.opacity_by_channel
    if tint is None or opacity.shape[1] == 1:
        return [(hierarchy.opacity, 1.0)]
    return list(zip(opacity.T, tint.T, strict=True))


def _mean_of(channels: Sequence[tuple[Array, ...]]) -> tuple[Array, ...]:
    """Return the means of several arrays over one or three channels."""
    if len(channels) == 1:
        return channels[0]
    return tuple(np.mean(values, axis=0) for values in zip(*channels, strict=True))


def sent(hierarchy: Hierarchy, links: Links, at_links: Array | None = None) -> Array:
    """Return (e, 4, 1): the share of the light of each element's quarters that its own links carry.

    The transpose of `gather`, with reciprocity (handout (3.30)): Σ_r A_r F_rs V_rs / A_s, of each
    receiver's opaque area; `at_links` (l,) are other A_r F_rs V_rs [m²], scaled.
    """
    if at_links is None:
        at_links = taken_at_links(hierarchy, links)
    single = np.flatnonzero(links.source >= hierarchy.n_clusters)
    element = links.source[single].astype(np.int64) - hierarchy.n_clusters
    per_element = at_links[single] / hierarchy.area[element]
    inner = np.flatnonzero(hierarchy.first_child[element] != LEAF)
    # Leaves send equally from all their quarters.
    total = np.bincount(element, per_element, hierarchy.n_elements)[:, None, None]
    total = np.repeat(total, 4, axis=1)
    single, element, per_element = single[inner], element[inner], per_element[inner]
    split = np.flatnonzero(hierarchy.first_child != LEAF)
    for quarter in range(4):
        share = per_element * links.of_quarter[single, quarter]
        total[split, quarter, 0] = np.bincount(element, share, hierarchy.n_elements)[split]
    return total
