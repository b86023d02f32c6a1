"""Let every leaf send out what it has: no more, no less.

Links of different levels do not add up at a leaf. It has fine links of its own to what is
near and shares its ancestors' coarse links to what is far; in a corner the own ones are
strong and the shared ones then too strong. The face's mean is exact, a leaf's sum may be a
quarter off, and as such leaves are also brighter or darker than the rest of their face,
power is made or lost, more with every bounce (6 % at a reflectance of 0.9).

So rays find what share of each leaf's light arrives anywhere at all, in a closed scene
simply all of it. What the leaf's own links leave of that is what it sends over shared ones:
its radiosity is scaled when they take their mean. Where its own links alone send more than
it has (faces that lie in one another are all hit), those are scaled too: so no leaf ever
sends more than it has, and the iteration converges whatever the scene. The factors in the links stay as they
are: what they add up to, and so what a coarse visibility loses, is reported as the closure.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array
from .cluster_links import ClusterLinks, gather_at_clusters
from .hierarchy import LEAF, Hierarchy, node_opacity
from .links import Links
from .node_samples import node_samples
from .parallel import for_chunks
from .sampling import cosine_hemisphere, stratified_square, to_world
from .transport import gather, node_radiosity, pull, push
from .tree_top import TreeTop
from .visibility import RayCaster

RAYS = 32
"""Hemisphere rays of a leaf; in a closed scene they all agree, and there is no noise at all."""

ROUNDS = 2
"""How often both balances are struck in turn."""

CHUNK = 1 << 13
"""Leaves measured at once: their rays take about 30 MB a thread."""

LIMIT = 2.0
"""Largest factor: a leaf with hardly any links is not blown up."""

LIMIT_RECEIVED = 1.5
"""Largest factor on what a face receives, and the inverse of the least: more is no error of a curve, and
must not be hidden."""


class Conservation:
    """Remembers what share of each leaf's light arrives, leaf by leaf as they appear."""

    def __init__(self, caster: RayCaster, min_area: float, seed: int, threads: int = 0) -> None:
        self._caster, self._min_area, self._seed, self._threads = caster, min_area, seed, threads
        self._arriving = np.zeros(0)

    def balance(
        self, hierarchy: Hierarchy, top: TreeTop, links: Links, cluster_links: ClusterLinks
    ) -> tuple[Array, Array]:
        """Return (e, 2) what leaves' radiosity, and (f,) what faces' gathered light is scaled with.

        The first as from `factors`, given the second, which is 1 where anything may escape,
        where faces are split, and everywhere without links to clusters: a few large faces
        are linked finely enough.
        """
        scale = self.factors(hierarchy, top, links, cluster_links)
        received = np.ones(len(hierarchy.faces))
        if len(cluster_links) == 0:
            return scale, received
        # Leaves of a split face share light unevenly, rightly: no one number mends them.
        whole = hierarchy.first_child[: len(hierarchy.faces)] == LEAF
        closed = self.closed(hierarchy) & whole
        for _ in range(ROUNDS):
            sums = received_by_faces(hierarchy, top, links, cluster_links, scale)
            wanted = np.clip(1.0 / np.maximum(sums, 1e-300), 1.0 / LIMIT_RECEIVED, LIMIT_RECEIVED)
            received = np.where(closed & (sums > 0), wanted, 1.0)
            scale = self.factors(hierarchy, top, links, cluster_links, received)
        return scale, received

    def closed(self, hierarchy: Hierarchy) -> Array:
        """Return (f,) whether no ray of a face left the scene; after `factors`."""
        face = hierarchy.face[hierarchy.leaves]
        arrived = self._arriving[hierarchy.leaves] == 1.0
        return np.asarray(np.bincount(face, ~arrived, len(hierarchy.faces)) == 0)

    def factors(
        self,
        hierarchy: Hierarchy,
        top: TreeTop,
        links: Links,
        cluster_links: ClusterLinks,
        received: Array | None = None,
    ) -> Array:
        """Return (e, 2): what to scale leaves' radiosity with, over own links and over shared ones.

        Parameters
        ----------
        received : (f,) float64 or None
            What the faces' gathered light is scaled with.
        """
        self._measure(hierarchy)
        leaves = hierarchy.leaves
        at_links = taken_at_links(hierarchy, links)
        if received is not None:
            at_links *= received[hierarchy.face[links.receiver]]
        sums = sent(hierarchy, links, at_links)
        own = sums[leaves].mean(axis=1)[:, 0]
        at_clusters = Arriving(hierarchy, top, cluster_links, received)
        sums = sums + sent_to_clusters(hierarchy, cluster_links, at_clusters)
        from_clusters = _from_clusters(hierarchy, top, links, at_links, cluster_links, at_clusters)
        shared = push(hierarchy, sums + from_clusters)[leaves, 0] - own
        arriving = self._arriving[leaves]
        left = np.maximum(arriving - own, 0.0)
        result = np.ones((hierarchy.n_elements, 2))
        result[leaves, 0] = np.minimum(1.0, arriving / np.maximum(own, 1e-300))
        result[leaves, 1] = np.where(shared > 0, np.minimum(left / np.maximum(shared, 1e-300), LIMIT), 1.0)
        return result

    def _measure(self, hierarchy: Hierarchy) -> None:
        """Trace the rays of leaves that are new."""
        known = len(self._arriving)
        self._arriving = np.concatenate([self._arriving, np.full(hierarchy.n_elements - known, np.nan)])
        leaves = hierarchy.leaves
        new = leaves[np.isnan(self._arriving[leaves])]
        faces = new[new < len(hierarchy.faces)]
        if len(faces):
            # Neighbours that together are no larger than an element may be share their rays.
            large = np.flatnonzero(hierarchy.clusters.area > self._min_area)
            top = TreeTop(hierarchy, large)
            share = self._share(hierarchy, top.tips)
            self._arriving[faces] = share[top.tip[faces] - top.n_inner]
        below = new[len(faces) :]
        self._arriving[below] = self._share(hierarchy, hierarchy.n_clusters + below)

    def _share(self, hierarchy: Hierarchy, nodes: Array) -> Array:
        """Return (n,) the share of the light of nodes that arrives anywhere."""
        share = np.empty(len(nodes))

        def measure(rows: slice) -> None:
            chosen = nodes[rows]
            quarter = np.broadcast_to(np.arange(RAYS) % 4, (len(chosen), RAYS))
            points, normals = node_samples(hierarchy, chosen, quarter, chosen, self._seed + 41)
            unit = stratified_square(chosen, RAYS, self._seed + 42)
            normals = normals.reshape(-1, 3)
            directions = to_world(cosine_hemisphere(unit).reshape(-1, 1, 3), normals)[:, 0]
            start = points.reshape(-1, 3) + self._caster.surface_offset * normals
            escapes = self._caster.passing(start, directions, np.full(len(start), np.inf))
            share[rows] = 1.0 - escapes.reshape(-1, RAYS).mean(axis=1)

        for_chunks(measure, len(nodes), CHUNK, self._threads)
        return share


class Arriving:
    """What the receivers of links to clusters take where they are there, per unit of the source's radiosity.

    Parameters
    ----------
    received : (f,) float64 or None
        What their faces' light is scaled with.

    Attributes
    ----------
    power : (l,) float64
        Σ A_f a_f (n_f·v + g·(x_f − c) + h) over the receiver's faces [m²].
    area : (l,) float64
        Σ A_f a_f [m²]
    """

    def __init__(
        self, hierarchy: Hierarchy, top: TreeTop, links: ClusterLinks, received: Array | None
    ) -> None:
        clusters, faces = hierarchy.clusters, hierarchy.faces
        if received is None:
            self.area = (clusters.area * node_opacity(hierarchy)[: len(clusters)])[links.receiver]
            self.power = self.area * links.factor * links.visibility
            return
        weight = (received * faces.area * faces.opacity)[:, None]
        sums = top.sums(np.concatenate([weight, weight * faces.normal, weight * faces.centre], axis=1))
        at = sums[top.row[links.receiver]]
        self.area = at[:, 0]
        offset = at[:, 4:] - at[:, :1] * clusters.centre[links.receiver]
        self.power = at[:, 0] * links.even + np.einsum("lk,lk->l", at[:, 1:4], links.vector)
        self.power += np.einsum("lk,lk->l", offset, links.gradient)


def received_by_faces(
    hierarchy: Hierarchy, top: TreeTop, links: Links, cluster_links: ClusterLinks, scale: Array
) -> Array:
    """Return (f,) ΣFV over each face's, its elements' and its clusters' links, sources scaled by `scale`."""
    there = hierarchy.opacity[:, None]
    own = pull(hierarchy, push(hierarchy, gather(hierarchy, links, there, scale, top)))
    means = node_radiosity(hierarchy, pull(hierarchy, scale[:, 1:] * there), top)
    shared = np.maximum(gather_at_clusters(hierarchy, top, cluster_links, means)[:, 0], 0.0)
    return np.asarray(own[: len(hierarchy.faces), 0] + shared)


def _from_clusters(
    hierarchy: Hierarchy,
    top: TreeTop,
    links: Links,
    at_links: Array,
    cluster_links: ClusterLinks,
    arriving: Arriving,
) -> Array:
    """Return (e, 4, 1) the share that the links of the clusters above each face carry."""
    clusters, faces, count = hierarchy.clusters, hierarchy.faces, hierarchy.n_clusters
    total = np.zeros((hierarchy.n_elements, 4, 1))
    if count == 0:
        return total
    # Linear in the face's place: (1, y) times four numbers a cluster, as `gather_at_clusters` sends.
    share = np.zeros((top.n_rows, 4))
    grouped = np.flatnonzero(links.source < count)
    source = links.source[grouped]
    share[:, 0] += top.spread(source, at_links[grouped] / clusters.area[source])
    grouped = np.flatnonzero(cluster_links.source < count)
    source = cluster_links.source[grouped]
    slope = (arriving.area[grouped] / clusters.area[source])[:, None] * cluster_links.gradient[grouped]
    evenly = arriving.power[grouped] / clusters.area[source]
    share[:, 0] += top.spread(source, evenly + np.einsum("lk,lk->l", slope, clusters.centre[source]))
    for axis in range(3):
        share[:, 1 + axis] -= top.spread(source, slope[:, axis])
    carried = np.zeros(len(faces))
    for term, pushed in zip((np.ones(1), *faces.centre.T), top.push(share).T, strict=True):
        carried += term * pushed[top.tip]
    total[: len(faces)] = np.maximum(carried, 0.0)[:, None, None]
    return total


def sent_to_clusters(hierarchy: Hierarchy, links: ClusterLinks, arriving: Arriving) -> Array:
    """Return (e, 1, 1): the share of the light of each element that its own links to clusters carry."""
    single = links.source >= hierarchy.n_clusters
    element = links.source[single] - hierarchy.n_clusters
    power = arriving.power[single]
    return np.bincount(element, power / hierarchy.area[element], hierarchy.n_elements)[:, None, None]


def taken_at_links(hierarchy: Hierarchy, links: Links) -> Array:
    """Return (l,) A_r F_rs V_rs [m²] of links to elements, of each receiver's area A_r what is there."""
    there = hierarchy.area * hierarchy.opacity
    return np.asarray(there[links.receiver] * links.factor * links.visibility)


def sent(hierarchy: Hierarchy, links: Links, at_links: Array | None = None) -> Array:
    """Return (e, 4, 1): the share of the light of each element's quarters that its own links carry.

    The transpose of `gather`, with reciprocity (handout (3.30)): Σ_r A_r F_rs V_rs / A_s, of each
    receiver's area what is there; `at_links` (l,) are other A_r F_rs V_rs [m²], scaled.
    """
    if at_links is None:
        at_links = taken_at_links(hierarchy, links)
    single = links.source >= hierarchy.n_clusters
    element = links.source[single] - hierarchy.n_clusters
    per_element = at_links[single] / hierarchy.area[element]
    inner = hierarchy.first_child[element] != LEAF
    total = np.zeros((hierarchy.n_elements, 4, 1))
    for quarter in range(4):
        share = np.where(inner, links.of_quarter[single, quarter], 1.0)
        total[:, quarter, 0] = np.bincount(element, per_element * share, hierarchy.n_elements)
    return total
