"""Clusters: one binary tree above the faces, so that n faces need not link n times n.

The tree is split level by level at the median of the widest axis of (position, a share of
the cluster's own diagonal · normal): neighbors that face the same way stay together, so that low clusters
are pieces of one wall and only high ones mix directions.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...numerics import Array, run_numbers, run_starts, running_sums
from ...scene import Faces

NORMAL_WEIGHT = 0.25
"""Opposite normals count like this share of the cluster's diagonal, twice, …"""

SMALL, SMALL_NORMAL_WEIGHT = 0.002, 2.0
"""… and more in clusters below this share of all area, whose position hardly matters: so a
corner's faces fall into pieces of single walls, which may be linked as wholes."""


WITHIN = 1.0 - 1e-9
"""Scale of sorted positions within a run: below 1 after rounding."""


class Clusters:
    """c clusters as arrays; node numbers of single faces start at c.

    order (f,) int32: Faces such that every cluster is a run of them.
    start, end (c,) int32: The cluster's run in `order`.
    children (c, 2) int32: Nodes: clusters, or n_clusters + face.
    lower, upper (c, 3): Bounding box [m].
    area (c,) [m²].
    area_before (f + 1,): Running sum of the faces' areas along `order`.
    normal (c, 3): Area-weighted mean of the unit normals; its length is the coherence.
    center (c, 3): Area-weighted centroid [m].
    cone (c,): Largest angle between the mean normal and a face's [rad].
    levels: Clusters of each depth, the roots first; children lie one level deeper than parents.
    """

    STORED = ("order", "start", "children", "area", "center", "levels")

    def __init__(self, order: Array, start: Array, end: Array, children: Array) -> None:
        self.order, self.start, self.end, self.children = order, start, end, children
        self.lower = self.upper = np.zeros((0, 3))
        self.area = np.zeros(0)
        self.area_before = np.zeros(1)
        self.normal = self.center = np.zeros((0, 3))
        self.cone = np.zeros(0)
        self.levels: list[slice] = []

    @property
    def middle(self) -> Array:
        """(c, 3) float64: the middle of each box [m]."""
        return np.asarray(0.5 * (self.lower + self.upper))

    @property
    def coherence(self) -> Array:
        """(c,) float64: length of the area-weighted mean of the unit normals: 1 for a piece of one plane."""
        return np.asarray(np.linalg.norm(self.normal, axis=1))

    def __len__(self) -> int:
        return len(self.start)

    def measure(self, faces: Faces) -> None:
        """Fill in areas and boxes."""
        self.area_before = running_sums(faces.area[self.order])
        self.area = self.sums(faces.area)
        if len(self) == 0:
            return
        self.normal = self.average(faces.normal, faces.area)
        self.center = self.average(faces.corners.mean(axis=1), faces.area)
        # reduceat over start, end pairs: every other result is the run itself.
        bounds = np.stack([self.start, self.end], axis=1).ravel()
        padded = np.minimum(bounds, len(self.order) - 1)
        last = self.end == len(self.order)
        self.lower, self.upper = np.empty((2, len(self), 3))
        for axis in range(3):
            along = faces.corners[..., axis]
            lower, upper = along.min(axis=1)[self.order], along.max(axis=1)[self.order]
            self.lower[:, axis] = np.minimum.reduceat(lower, padded)[::2]
            self.upper[:, axis] = np.maximum.reduceat(upper, padded)[::2]
            self.lower[last, axis] = np.minimum(self.lower[last, axis], lower[-1])
            self.upper[last, axis] = np.maximum(self.upper[last, axis], upper[-1])
        self._measure_cones(faces)

    def forget_shapes(self) -> None:
        """Free what only decides which links there are: once these are made, nothing asks for it."""
        self.lower = self.upper = self.normal = np.zeros((0, 3))
        self.cone = np.zeros(0)

    def _measure_cones(self, faces: Faces) -> None:
        """Bound the normals of every cluster by a cone about their mean, from the children's up."""
        count = len(self)
        coherence = self.coherence
        axis = np.concatenate([self.normal / np.maximum(coherence, 1e-300)[:, None], faces.normal])
        angle = np.concatenate([np.full(count, np.pi), np.zeros(len(faces))])
        for level in reversed(self.levels):
            child = self.children[level]
            cosine = np.einsum("nk,nck->nc", axis[level], axis[child])
            apart = np.arccos(np.clip(cosine, -1.0, 1.0))
            angle[level] = np.minimum((apart + angle[child]).max(axis=1), np.pi)
        self.cone = np.where(coherence > 1e-6, angle[:count], np.pi)

    def average(self, values: Array, areas: Array) -> Array:
        """Return the (c, k) area-weighted means of (f, k) face `values`."""
        mean = np.empty((len(self), values.shape[1]))
        for column in range(values.shape[1]):
            mean[:, column] = self.sums(values[:, column] * areas) / self.area
        return mean

    def sums(self, values: Array) -> Array:
        """Return the (c, …) sums of (f, …) face values over each cluster, children first.

        Never as differences of one running sum: in those the rounding of the large faces
        would drown clusters of tiny ones.
        """
        total = np.concatenate([np.zeros((len(self), *values.shape[1:])), values])
        for level in reversed(self.levels):
            child = self.children[level]
            total[level] = total[child[:, 0]] + total[child[:, 1]]
        return np.asarray(total[: len(self)])


def build_clusters(faces: Faces, groups: Sequence[Array]) -> tuple[Clusters, Array]:
    """Build a tree over each group of faces.

    groups sequence of (g,) int: Disjoint; empty ones are skipped.
    Returns roots (r,) int64: One node per non-empty group.
    """
    position = np.concatenate([faces.corners.mean(axis=1), faces.normal], axis=1)

    order = np.concatenate([np.asarray(group, dtype=np.int64) for group in groups])
    sizes = np.array([len(group) for group in groups], dtype=np.int64)
    ends = np.cumsum(sizes)
    start, end = (ends - sizes)[sizes > 0], ends[sizes > 0]
    tops = len(start)

    starts, ends_of, children = [], [], []
    levels: list[slice] = []
    numbered = 0
    while len(start):
        # Runs of two and more become clusters of this level; single faces are done.
        large = end - start > 1
        start, end = start[large], end[large]
        if len(start) == 0:
            break
        _sort_runs(order, position, faces.area, start, end)
        middle = (start + end) // 2
        starts.append(start)
        ends_of.append(end)
        levels.append(slice(numbered, numbered + len(start)))
        numbered += len(start)
        halves_start = np.stack([start, middle], axis=1)
        halves_end = np.stack([middle, end], axis=1)
        wide = halves_end - halves_start > 1
        child = np.where(wide, 0, -1 - halves_start)
        child[wide] = numbered + np.arange(int(wide.sum()))
        children.append(child)
        start, end = halves_start.ravel(), halves_end.ravel()

    if starts:
        clusters = Clusters(order, np.concatenate(starts), np.concatenate(ends_of), np.concatenate(children))
    else:
        none = np.zeros(0, dtype=np.int64)
        clusters = Clusters(order, none, none, np.zeros((0, 2), dtype=np.int64))
    single = clusters.children < 0
    clusters.children[single] = len(clusters) + order[-1 - clusters.children[single]]
    for name in ("order", "start", "end", "children"):
        setattr(clusters, name, getattr(clusters, name).astype(np.int32))
    clusters.levels = levels
    clusters.measure(faces)

    first = np.concatenate([[0], np.cumsum(sizes[sizes > 0])])[:tops]
    is_cluster = sizes[sizes > 0] > 1
    roots = np.where(is_cluster, np.cumsum(is_cluster) - 1, len(clusters) + order[first] if tops else 0)
    return clusters, roots.astype(np.int64)


def _sort_runs(order: Array, position: Array, area: Array, start: Array, end: Array) -> None:
    """Sort each run of `order` along the widest axis of position and weighed normal, in place."""
    length = end - start
    run = np.repeat(np.arange(len(start)), length)
    first, slots = run_starts(length), run_numbers(length, start)
    local = position[order[slots]]
    least = np.minimum.reduceat(local, first, axis=0)
    extent = np.maximum.reduceat(local, first, axis=0) - least
    width = extent.copy()
    share = np.add.reduceat(area[order[slots]], first) / area.sum()
    weight = np.where(share < SMALL, SMALL_NORMAL_WEIGHT, NORMAL_WEIGHT)[:, None]
    width[:, 3:] *= weight * np.linalg.norm(width[:, :3], axis=1, keepdims=True)
    axis = width.argmax(axis=1)
    runs = np.arange(len(start))
    key = local[np.arange(len(run)), axis[run]] - least[runs, axis][run]
    # Run and place in one number, below the next run's: several times as fast as sorting by both.
    key *= (WITHIN / np.maximum(extent[runs, axis], 1e-300))[run]
    key += run
    order[slots] = order[slots][np.argsort(key, kind="stable")]
