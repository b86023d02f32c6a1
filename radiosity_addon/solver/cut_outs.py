"""Rays through surfaces that are only partly there: leaves, fences, veils.

Triangles that anything may be seen through are kept in a second ray caster, so that the others
are asked as ever, and a scene without any has no second one. A ray that meets such a triangle
looks up the opacity there. Where that is 0 or 1 the answer is plain; between, the surface stops
the ray if a number that is drawn for the ray and the triangle is below it. That number depends
on nothing but the two, so results do not depend on how rays are divided among threads.
"""

from __future__ import annotations

from threading import Lock

import numpy as np

from .arrays import Array
from .embree import TARGET_SLACK, EmbreeCaster
from .sampling import hash_keys
from .scene import Scene
from .surface_images import SurfaceImages
from .visibility import NO_HIT, Hits, RayCaster, surface_offset

MOST_LAYERS = 1000
"""A ray that passed so many surfaces is stopped by the next."""


def ray_caster(scene: Scene, threads: int = 0) -> RayCaster:
    """Return what answers visibility queries about a scene."""
    if scene.images is None or not scene.images.cut_out.any():
        return EmbreeCaster(scene.triangles, threads)
    return CutOutCaster(scene.triangles, scene.images, threads)


class CutOutCaster:
    """Visibility among triangles of which some are partly there.

    Parameters
    ----------
    triangles : (t, 3, 3) float64
        World-space corners [m].
    images : SurfaceImages
        Of the same triangles.
    threads : int
        0 means all cores. Results do not depend on it.
    """

    def __init__(self, triangles: Array, images: SurfaceImages, threads: int = 0) -> None:
        self.rays = 0
        self._counting = Lock()
        self.surface_offset = surface_offset(triangles)
        self._images = images
        self._whole_rows = np.append(np.flatnonzero(~images.cut_out), NO_HIT).astype(np.int32)
        self._cut_rows = np.append(np.flatnonzero(images.cut_out), NO_HIT).astype(np.int32)
        self._whole = EmbreeCaster(triangles[~images.cut_out], threads)
        self._cut = EmbreeCaster(triangles[images.cut_out], threads)

    def visible(self, origins: Array, directions: Array, distances: Array) -> Array:
        """Return (n,) bool: nothing that is there lies within `distances` along the unit `directions`."""
        self._count(len(origins))
        free = self._whole.visible(origins, directions, distances)
        rows = np.flatnonzero(free)
        reach = distances[rows] * (1.0 - TARGET_SLACK)
        free[rows] = self._first_there(origins[rows], directions[rows], reach).triangle == NO_HIT
        return free

    def first_hits(self, origins: Array, directions: Array) -> Hits:
        """Return what each ray meets first of what is there."""
        self._count(len(origins))
        hits = self._whole.first_hits(origins, directions)
        nearer = self._first_there(origins, directions, hits.distance)
        is_cut = nearer.triangle != NO_HIT
        return Hits(
            np.where(is_cut, nearer.triangle, self._whole_rows[hits.triangle]),
            np.where(is_cut[:, None], nearer.barycentric, hits.barycentric),
            np.where(is_cut, nearer.front, hits.front),
            np.where(is_cut, nearer.distance, hits.distance),
        )

    def _first_there(self, origins: Array, directions: Array, reach: Array) -> Hits:
        """Return the first cut-outs within `reach` that stop the rays."""
        count = len(origins)
        triangle = np.full(count, NO_HIT, dtype=np.int32)
        barycentric = np.zeros((count, 2), dtype=np.float32)
        front = np.zeros(count, dtype=bool)
        distance = np.full(count, np.inf, dtype=np.float32)
        gone = np.zeros(count)
        going = np.arange(count)
        for layer in range(MOST_LAYERS + 1):
            start = origins[going] + gone[going, None] * directions[going]
            hits = self._cut.first_hits(start, directions[going])
            far = gone[going] + hits.distance
            met = np.flatnonzero((hits.triangle != NO_HIT) & (far < reach[going]))
            if len(met) == 0:
                break
            going, far, hits = going[met], far[met], hits.take(met)
            rows = self._cut_rows[hits.triangle]
            opacity = self._images.opacity_at(rows, hits.barycentric)
            stops = opacity > _drawn(origins[going], directions[going], rows)
            stops |= layer == MOST_LAYERS
            stopped = going[stops]
            triangle[stopped], distance[stopped] = rows[stops], far[stops]
            barycentric[stopped], front[stopped] = hits.barycentric[stops], hits.front[stops]
            gone[going] = far + self.surface_offset
            going = going[~stops]
        return Hits(triangle, barycentric, front, distance)

    def _count(self, rays: int) -> None:
        with self._counting:
            self.rays += rays


def _drawn(origins: Array, directions: Array, triangle: Array) -> Array:
    """Return (n,) numbers in [0, 1) that look random, each a function of its ray and triangle alone."""
    ray = np.concatenate([origins, directions], axis=1).astype(np.float32).view(np.uint32)
    bits = hash_keys(triangle, 61)
    for column in range(6):
        bits = hash_keys(ray[:, column].astype(np.uint64) << np.uint64(32) | bits, 62)
    return np.asarray(bits * 2.0**-32)
