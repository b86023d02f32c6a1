"""Enclosure: the share of the light of leaves that arrives at surfaces, measured by rays.

In a closed scene all of it, and the rays agree: no noise. Light that leaves the scene arrives nowhere,
nor does what ends on the black back of a one-sided triangle.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ...numerics import Array, Stream, cosine_hemisphere, fill_chunks, stratified_square, to_world
from ...rays import RayCaster
from ..hierarchy import ClusterCut, Hierarchy
from ..links import node_samples

LEAF_RAYS = 32
"""Hemisphere rays of a leaf; in a closed scene they all agree, and there is no noise at all."""

EMISSIVE_LEAF_RAYS = 512
"""Rays of an emissive leaf, where not all of the others arrive: most power starts there."""

SPREAD_RAYS = 1 << 17
"""Total number of rays, by area, where not all arrive: each of a few large leaves carries much light …"""

MOST_OF_ONE = 1 << 13
"""… but at most this many per leaf."""

MOST_RAYS = 1 << 20
"""Neighbors whose shared rays disagree trace their own, unless there would be more than these."""

CHUNK = 1 << 13
"""Leaves measured at once: their rays take about 30 MB a thread."""


class Arrivals:
    """Stores the share of each leaf's light that arrives, as leaves appear.

    share (e,): Of leaves, what part of their light arrives; of those that never were leaves NaN.
    rays (e,) int32: How many were traced.
    """

    def __init__(self, caster: RayCaster, min_area: float, seed: int, threads: int = 0) -> None:
        self._caster, self._min_area, self._seed, self._threads = caster, min_area, seed, threads
        self.share = np.zeros(0)
        self.rays = np.zeros(0, dtype=np.int32)

    def measure(self, hierarchy: Hierarchy) -> None:
        """Trace the rays of leaves that are new."""
        more = hierarchy.n_elements - len(self.share)
        self.share = np.concatenate([self.share, np.full(more, np.nan)])
        self.rays = np.concatenate([self.rays, np.full(more, LEAF_RAYS, dtype=np.int32)])
        leaves = hierarchy.leaves
        new = leaves[np.isnan(self.share[leaves])]
        faces = new[new < len(hierarchy.faces)]
        if len(faces):
            # Neighbors that together are no larger than an element may be share their rays.
            large = np.flatnonzero(hierarchy.clusters.area > self._min_area)
            cut = ClusterCut(hierarchy, large)
            share = self._trace(hierarchy, cut.nodes, LEAF_RAYS)
            node = cut.row_of_face[faces] - cut.n_inner
            self.share[faces] = share[node]
            apart = faces[(share[node] > 0.0) & (share[node] < 1.0) & (np.bincount(node)[node] > 1)]
            if len(apart) * LEAF_RAYS <= MOST_RAYS:
                self._ask(hierarchy, apart, LEAF_RAYS)
        self._ask(hierarchy, new[len(faces) :], LEAF_RAYS)
        doubtful = new[(self.share[new] > 0.0) & (self.share[new] < 1.0)]
        rays = self._wanted(hierarchy, doubtful)
        for count in np.unique(rays[rays > LEAF_RAYS]):
            self._ask(hierarchy, doubtful[rays == count], int(count))

    def _wanted(self, hierarchy: Hierarchy, leaves: Array) -> Array:
        """Return (n,) the number of rays of leaves whose light does not all arrive.

        It depends on nothing but the leaf: the same whenever it appears.
        """
        part = hierarchy.area[leaves] / float(hierarchy.faces.area.sum())
        # By powers of four, so that many leaves are traced together.
        power = np.rint(0.5 * np.log2(np.maximum(part * (SPREAD_RAYS / LEAF_RAYS), 1.0)))
        rays = np.minimum(LEAF_RAYS * 4 ** power.astype(np.int64), MOST_OF_ONE)
        large = hierarchy.area[leaves] >= self._min_area
        shines = hierarchy.emission[leaves].any(axis=1)
        rays[large & shines] = np.maximum(rays[large & shines], EMISSIVE_LEAF_RAYS)
        return np.asarray(rays)

    def error(self, leaves: Array) -> Array:
        """Return (n,) the standard error of leaves' shares."""
        share = self.share[leaves]
        return np.asarray(np.sqrt(share * (1.0 - share) / self.rays[leaves]))

    def _ask(self, hierarchy: Hierarchy, leaves: Array, rays: int) -> None:
        """Trace a number of rays of each of these leaves."""
        self.share[leaves] = self._trace(hierarchy, hierarchy.n_clusters + leaves, rays)
        self.rays[leaves] = rays

    def _trace(self, hierarchy: Hierarchy, nodes: Array, rays: int) -> Array:
        """Return (n,) the share of the light of nodes that arrives."""
        share = np.empty(len(nodes))
        measure = partial(_arriving, hierarchy, self._caster, nodes, rays, self._seed)
        fill_chunks(measure, share, len(nodes), CHUNK * LEAF_RAYS // rays, self._threads)
        return share


def _arriving(
    hierarchy: Hierarchy, caster: RayCaster, nodes: Array, rays: int, seed: int, rows: slice
) -> Array:
    """Return (r,) the share of the light of nodes that arrives."""
    faces, chosen = hierarchy.faces, nodes[rows]
    quarter = np.broadcast_to(np.arange(rays) % 4, (len(chosen), rays))
    streams = Stream.ENCLOSURE_POINTS, Stream.ENCLOSURE_FACE
    points, normals = node_samples(hierarchy, chosen, quarter, chosen, seed, streams)
    unit = stratified_square(chosen, rays, seed + Stream.ENCLOSURE_DIRECTIONS)
    normals = normals.reshape(-1, 3)
    directions = to_world(cosine_hemisphere(unit).reshape(-1, 1, 3), normals)[:, 0]
    start = points.reshape(-1, 3) + caster.surface_offset * normals
    if faces.has_black_backs:
        hits = caster.intersect(start, directions)
        black = faces.of_triangle[(~hits.front).astype(np.int8), hits.triangle] < 0
        lost = (hits.triangle < 0) | black
    else:
        lost = caster.passing(start, directions, np.full(len(start), np.inf))
    return np.asarray(1.0 - lost.reshape(-1, rays).mean(axis=1))
