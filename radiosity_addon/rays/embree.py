"""Ray casting with Embree: the only module that imports embreex.

It owns what Embree needs: float32, origins moved to the scene's center (so that a scene
far from the origin keeps its precision), batches on threads, the first query single; and copies of
what lies back to back with a black back (`scene/coincident_pairs.py`).
"""

from __future__ import annotations

import time
from functools import partial
from threading import Lock
from typing import Any

import numpy as np

from ..numerics import Array, double_area_vectors, fill_chunks
from .caster import NO_HIT, Hits, RayCaster, surface_offset
from .coplanar import facing_copies
from .ray_count import RayCount

CHUNK = 1 << 16
"""Rays a call: large enough to hide the call's 2 µs, small enough for cache and threads."""

TARGET_SLACK = 1e-5
"""A segment is tested up to this fraction short of its end, in float32's reach."""


class _Work:
    """What Embree has done in this process: processor seconds and rays."""

    def __init__(self) -> None:
        self.seconds, self.rays = 0.0, 0
        self._counting = Lock()

    def run(self, scene: Any, start: Array, along: Array, **query: Any) -> Any:
        """Trace rays, and count them."""
        started = time.thread_time()
        found = scene.run(start, along, **query)
        taken = time.thread_time() - started
        with self._counting:
            self.seconds += taken
            self.rays += len(start)
        return found


_WORK = _Work()


def embree_work() -> tuple[float, int]:
    """Return processor seconds spent in Embree so far, and how many rays it traced."""
    return _WORK.seconds, _WORK.rays


class EmbreeCaster:
    """Visibility by Embree 4 in its robust mode, which leaks no ray through shared edges.

    triangles (t, 3, 3): World-space corners [m].
    threads: 0 means all cores. Results do not depend on it.
    only (t,) bool: The triangles that rays meet; None for all.
    for_lamps: The caster for the light of lamps, if it differs.
    two_sided (t,) bool: The others' backs are black; None if that does not matter.
    """

    def __init__(
        self,
        triangles: Array,
        threads: int = 0,
        only: Array | None = None,
        for_lamps: RayCaster | None = None,
        two_sided: Array | None = None,
    ) -> None:
        self.own_rays = RayCount()
        self.tinted = False
        self._for_lamps = for_lamps
        self.surface_offset = surface_offset(triangles)
        self._threads = threads
        self._rows = None if only is None or only.all() else np.flatnonzero(only)
        if self._rows is not None:
            triangles = triangles[self._rows]
            two_sided = None if two_sided is None else two_sided[self._rows]
        self._empty = len(triangles) == 0
        if self._empty:
            return
        corners = triangles.reshape(-1, 3)
        self._center = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        triangles = triangles - self._center
        if two_sided is not None and not two_sided.all():
            copied, copies = facing_copies(triangles, two_sided, self.surface_offset)
            triangles = np.concatenate([triangles, copies])
            if len(copied):
                rows = np.arange(len(two_sided)) if self._rows is None else self._rows
                self._rows = np.concatenate([rows, rows[copied]])
        self._triangles = np.ascontiguousarray(triangles, dtype=np.float32)
        self._normals = double_area_vectors(self._triangles)
        self._build()

    def _build(self) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene = EmbreeScene()
        self._mesh = TriangleMesh(self._scene, self._triangles)
        # The first query builds the hierarchy; it must not race with another thread's.
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32), query="OCCLUDED")

    def __getstate__(self) -> dict[str, Any]:
        """Return what another process needs to make the same caster."""
        without = ("_scene", "_mesh", "own_rays")
        return {name: value for name, value in vars(self).items() if name not in without}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self.own_rays = RayCount()
        if not self._empty:
            self._build()

    @property
    def for_lamps(self) -> RayCaster:
        """The caster for the light of lamps; usually this one."""
        return self if self._for_lamps is None else self._for_lamps

    @property
    def rays(self) -> int:
        """Rays traced so far, those to lamps among them."""
        return self.own_rays.rays + (0 if self._for_lamps is None else self._for_lamps.rays)

    def unoccluded(self, origins: Array, directions: Array, distances: Array) -> Array:
        """Return (n,) bool: nothing lies within `distances` along the unit `directions`."""
        count = len(origins)
        free = np.ones(count, dtype=bool)
        if self._empty or count == 0:
            return free
        self.own_rays.add(count)
        trace = partial(_unoccluded, self._scene, self._center, origins, directions, distances)
        fill_chunks(trace, free, count, CHUNK, self._threads)
        return free

    def passing(self, origins: Array, directions: Array, distances: Array, least: float = 0.0) -> Array:  # noqa: ARG002
        """Return the same: all surfaces are whole."""
        return self.unoccluded(origins, directions, distances)

    def passing_colors(
        self, origins: Array, directions: Array, distances: Array, least: float = 0.0
    ) -> Array:
        """Return the same for each channel."""
        return np.repeat(self.passing(origins, directions, distances, least)[:, None], 3, axis=1)

    def intersect(self, origins: Array, directions: Array) -> Hits:
        """Return what each ray meets first."""
        count = len(origins)
        triangle = np.full(count, NO_HIT, dtype=np.int32)
        barycentric = np.zeros((count, 2), dtype=np.float32)
        front = np.zeros(count, dtype=bool)
        distance = np.full(count, np.inf, dtype=np.float32)
        if self._empty or count == 0:
            return Hits(triangle, barycentric, front, distance)
        self.own_rays.add(count)
        trace = partial(
            _first_hits, self._scene, self._center, self._rows, self._normals, origins, directions
        )
        into = (triangle, barycentric[:, 0], barycentric[:, 1], front, distance)
        fill_chunks(trace, into, count, CHUNK, self._threads)
        return Hits(triangle, barycentric, front, distance)


def _unoccluded(
    scene: Any, center: Array, origins: Array, directions: Array, distances: Array, rows: slice
) -> Array:
    start = (origins[rows] - center).astype(np.float32)
    along = np.ascontiguousarray(directions[rows], dtype=np.float32)
    # A copy on purpose: Embree overwrites the distances it is given.
    reach = np.minimum(distances[rows] * (1.0 - TARGET_SLACK), 1e30).astype(np.float32)
    return np.asarray(_WORK.run(scene, start, along, dists=reach, query="OCCLUDED") != 0)


def _first_hits(
    scene: Any,
    center: Array,
    numbers: Array | None,
    normals: Array,
    origins: Array,
    directions: Array,
    rows: slice,
) -> tuple[Array, ...]:
    """Return the columns of `Hits`, barycentric coordinates one by one."""
    start = (origins[rows] - center).astype(np.float32)
    along = np.ascontiguousarray(directions[rows], dtype=np.float32)
    found = _WORK.run(scene, start, along, output=True)
    row = found["primID"]
    hit = row >= 0
    return (
        row if numbers is None else np.where(hit, numbers[row], NO_HIT),
        np.where(hit, found["u"], 0),
        np.where(hit, found["v"], 0),
        np.einsum("nk,nk->n", along, normals[row]) < 0,
        np.where(hit, found["tfar"], np.inf),
    )
