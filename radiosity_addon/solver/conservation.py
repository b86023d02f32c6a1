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
from .hierarchy import LEAF, Hierarchy
from .light_links import sky_visibility
from .links import Links
from .sampling import points_on_triangles, stratified_square
from .transport import push
from .visibility import RayCaster

RAYS = 32
"""Hemisphere rays of a leaf; in a closed scene they all agree, and there is no noise at all."""

LIMIT = 2.0
"""Largest factor: a leaf with hardly any links is not blown up."""


class Conservation:
    """Remembers what share of each leaf's light arrives, leaf by leaf as they appear."""

    def __init__(self, caster: RayCaster, seed: int) -> None:
        self._caster, self._seed = caster, seed
        self._arriving = np.zeros(0)

    def factors(self, hierarchy: Hierarchy, links: Links) -> Array:
        """Return (e, 2): what to scale leaves' radiosity with, over own links and over shared ones."""
        self._measure(hierarchy)
        leaves = hierarchy.leaves
        sums = sent(hierarchy, links)
        own = sums[leaves].mean(axis=1)[:, 0]
        shared = push(hierarchy, sums + self._from_clusters(hierarchy, links))[leaves, 0] - own
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
        points = points_on_triangles(hierarchy.corners[new], stratified_square(new, RAYS, self._seed + 41))
        normals = hierarchy.normal[new]
        self._arriving[new] = 1.0 - sky_visibility(points, normals, RAYS, self._caster, new, self._seed + 42)

    @staticmethod
    def _from_clusters(hierarchy: Hierarchy, links: Links) -> Array:
        """Return (e, 4, 1) the share that the links of the clusters above each face carry."""
        clusters, n_clusters = hierarchy.clusters, hierarchy.n_clusters
        total = np.zeros((hierarchy.n_elements, 4, 1))
        grouped = links.source < n_clusters
        if grouped.any():
            power = (hierarchy.area[links.receiver] * links.factor * links.visibility)[grouped]
            per_cluster = np.bincount(links.source[grouped], power, n_clusters) / clusters.area
            # A run of faces each: what starts at its first and stops behind its last.
            steps = np.bincount(clusters.start, per_cluster, len(clusters.order) + 1)
            steps -= np.bincount(clusters.end, per_cluster, len(clusters.order) + 1)
            total[clusters.order] = np.cumsum(steps)[:-1, None, None]
        return total


def sent(hierarchy: Hierarchy, links: Links) -> Array:
    """Return (e, 4, 1): the share of the light of each element's quarters that its own links carry.

    The transpose of `gather`, with reciprocity (handout (3.30)): Σ_r A_r F_rs V_rs / A_s.
    """
    single = links.source >= hierarchy.n_clusters
    element = links.source[single] - hierarchy.n_clusters
    power = (hierarchy.area[links.receiver] * links.factor * links.visibility)[single]
    per_element = power / hierarchy.area[element]
    inner = hierarchy.first_child[element] != LEAF
    total = np.zeros((hierarchy.n_elements, 4, 1))
    for quarter in range(4):
        share = np.where(inner, links.of_quarter[single, quarter], 1.0)
        total[:, quarter, 0] = np.bincount(element, per_element * share, hierarchy.n_elements)
    return total
