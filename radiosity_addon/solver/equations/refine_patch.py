"""Refines pairs of faces until they can be linked (handout §4.2, RefinePatch).

The handout's recursion treats each pair alone, so the order in which pairs are treated does
not matter: here one generation of pairs after the other, as arrays.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array
from ..hierarchy import LEAF, Hierarchy
from .form_factor_oracle import oracle1, source_factor_bounds

BLOCK_PAIRS = 1 << 22
"""Pairs of faces tested together for facing each other; some 100 MB."""


def facing_pairs(hierarchy: Hierarchy) -> tuple[Array, Array]:
    """Return every ordered pair of distinct faces that are not behind each other's planes.

    Returns receiver, source (n,) int32: At most k (k − 1) pairs of k faces; every pair comes with its
        opposite.
    """
    corners = hierarchy.faces.corners
    count = len(corners)
    if count < 2:
        none = np.zeros(0, dtype=np.int32)
        return none, none
    # About their middle, so that rooms far from the origin lose no digits.
    corners = corners - corners.mean(axis=(0, 1))
    normal, center = hierarchy.faces.normal, corners.mean(axis=1)
    offset = np.einsum("nk,nk->n", center, normal)
    radius = np.linalg.norm(corners - center[:, None], axis=2).max(axis=1)
    # Slightly below the plane still counts: the exact bound decides.
    slack = 1e-12 * float(np.abs(corners).max())
    step = max(BLOCK_PAIRS // count, 1)
    receivers, sources = [], []
    for start in range(0, count, step):
        rows = slice(start, start + step)
        rise = (corners.reshape(-1, 3) @ normal[rows].T).reshape(count, 3, -1).max(axis=1) - offset[rows]
        mutual = -slack < rise.T
        rise = (normal @ corners[rows].reshape(-1, 3).T).reshape(count, -1, 3).max(axis=2) - offset[:, None]
        mutual &= -slack < rise.T
        receiver, source = np.nonzero(mutual)
        receiver += start
        del rise, mutual
        kept = (receiver != source) & (radius[receiver] > 0) & (radius[source] > 0)
        receiver, source = receiver[kept], source[kept]
        seen = source_factor_bounds(hierarchy, receiver, source) > 0
        receivers.append(receiver[seen].astype(np.int32))
        sources.append(source[seen].astype(np.int32))
    return np.concatenate(receivers), np.concatenate(sources)


class RefinePatch:
    """Pairs that are refined until they are linked.

    A pair that Oracle1 does not accept is replaced by those with the four children of its
    *receiver*; only where the receiver may not get children, by those of its source; where
    neither may, it is linked after all. Pairs behind each other's planes are dropped.

    hierarchy: Gets children as pairs need them.
    error: F_ε.
    min_area: A_ε [m²]: no element becomes smaller.
    max_links: Where the pairs would become more, the largest form factors are refined first.
    receiver, source (n,) int32: Pairs still to be evaluated.
    unrefined (m, 2) int32: Receiver and source of those linked only because of `max_links`.
    """

    def __init__(self, hierarchy: Hierarchy, error: float, min_area: float, max_links: int) -> None:
        self.hierarchy = hierarchy
        self.error, self.min_area, self.max_links = error, min_area, max_links
        self.receiver, self.source = facing_pairs(hierarchy)
        self.unrefined = np.zeros((0, 2), dtype=np.int32)
        self.linked = 0
        """Pairs accepted so far."""
        self._links: list[tuple[Array, Array]] = []

    def generation(self) -> bool:
        """Evaluate all waiting pairs once and replace rejected ones; return whether any are waiting now."""
        hierarchy = self.hierarchy
        bound = source_factor_bounds(hierarchy, self.receiver, self.source)
        seen = bound > 0
        receiver, source, bound = self.receiver[seen], self.source[seen], bound[seen]
        area = hierarchy.area
        accepted = oracle1(bound, area[receiver], area[source], self.error, self.min_area)
        split_receiver = ~accepted & may_split(hierarchy, receiver, self.min_area)
        split_source = ~accepted & ~split_receiver & may_split(hierarchy, source, self.min_area)
        self._keep_budget(receiver, source, bound, split_receiver, split_source)

        kept = ~(split_receiver | split_source)
        self._links.append((receiver[kept], source[kept]))
        self.linked += int(kept.sum())
        by_receiver = _children(hierarchy, receiver[split_receiver])
        by_source = _children(hierarchy, source[split_source])
        self.receiver = np.concatenate([by_receiver, np.repeat(receiver[split_source], 4)])
        self.source = np.concatenate([np.repeat(source[split_receiver], 4), by_source])
        return len(self.receiver) > 0

    def pairs(self) -> tuple[Array, Array]:
        """Return the (l,) int32 receivers and sources to link, sorted by receiver, then source."""
        receiver = np.concatenate([part[0] for part in self._links] or [self.receiver[:0]])
        source = np.concatenate([part[1] for part in self._links] or [self.source[:0]])
        order = np.lexsort((source, receiver))
        return receiver[order], source[order]

    def _keep_budget(
        self, receiver: Array, source: Array, bound: Array, split_receiver: Array, split_source: Array
    ) -> None:
        """Take back the splits that `max_links` has no room for, the smallest factors first; in place."""
        split = np.flatnonzero(split_receiver | split_source)
        room = max((self.max_links - self.linked - len(receiver)) // 3, 0)
        if len(split) <= room:
            return
        order = np.argsort(bound[split], kind="stable")[::-1]
        left = split[order[room:]]
        split_receiver[left] = split_source[left] = False
        left_pairs = np.stack([receiver[left], source[left]], axis=1)
        self.unrefined = np.concatenate([self.unrefined, left_pairs])


def may_split(hierarchy: Hierarchy, elements: Array, min_area: float) -> Array:
    """Return (n,) whether elements have children or may get them (handout §4.2, Subdiv)."""
    inner = hierarchy.first_child[elements] != LEAF
    return np.asarray(inner | (hierarchy.area[elements] >= 4 * min_area))


def _children(hierarchy: Hierarchy, elements: Array) -> Array:
    """Return the (4 n,) int32 children of (n,) elements, made where there are none."""
    leaves = np.unique(elements[hierarchy.first_child[elements] == LEAF])
    hierarchy.subdivide(leaves)
    first = hierarchy.first_child[elements]
    return np.asarray((first[:, None] + np.arange(4, dtype=np.int32)).ravel())
