"""Rays through surfaces that are only partly there: leaves, fences, veils.

Triangles that are partly transparent are kept in a second ray caster, so that the others are traced
as usual, and a scene without any has no second one. A ray that meets such a triangle looks up the
opacity there. For the share of light that passes, transparencies are multiplied. For the first hit,
the surface is hit if a random number of the ray and the triangle is below the opacity; where opacity
is 0 or 1 nothing is random. The number depends on these two alone, so results do not depend on how
rays are divided among threads.

Glass is a cut-out whose opacity differs by channel. Light passes it by color. A ray that goes on through it
takes a tint along: of a surface that it might have hit, what passes relative to the chance that it does; of
glass that sends no light of its own there is nothing to hit, and the tint is all that passes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..numerics import Array, hash_keys
from ..rays import NO_HIT, TARGET_SLACK, EmbreeCaster, Hits, RayCaster, RayCount, surface_offset
from .layers import Layers
from .scene import Scene
from .stacks import Stacks
from .textures import SurfaceImages

MOST_LAYERS = 1000
"""A ray that has passed this many surfaces meets no others."""

FAINT, ENDED = 1.0 / 64.0, 1e-5
"""Where less light than the first share is left, a ray goes on with that share or ends with the second, by
chance, with as much in the mean (Russian roulette; Arvo and Kirk 1990): through dense foliage it would meet
all leaves of its way. A share of 0 would say that something opaque is there, and not to ask again."""


def ray_caster(scene: Scene, threads: int = 0) -> RayCaster:
    """Return the caster for light of a scene's surfaces; its `for_lamps` is the one for light of lamps."""
    lamps = None
    if (scene.in_shadows != scene.in_bounces).any():
        lamps = _caster(scene, threads, scene.in_shadows, None)
    return _caster(scene, threads, scene.in_bounces, lamps)


def _caster(scene: Scene, threads: int, only: Array, for_lamps: RayCaster | None) -> RayCaster:
    caster = _plain_caster(scene, threads, only, for_lamps)
    return LayeredCaster(caster, scene.layers) if scene.layers else caster


def _plain_caster(scene: Scene, threads: int, only: Array, for_lamps: RayCaster | None) -> RayCaster:
    if scene.images is None or not (scene.images.cut_out & only).any():
        return EmbreeCaster(scene.triangles, threads, only, for_lamps, scene.two_sided)
    stacks = Stacks(scene, only)
    return CutOutCaster(
        scene.triangles, scene.images, threads, only, for_lamps, scene.two_sided, stacks if stacks else None
    )


class LayeredCaster:
    """The same rays, but where several surfaces are in one place they meet the one that counts there."""

    def __init__(self, caster: RayCaster, layers: Layers) -> None:
        self._caster, self._layers = caster, layers
        self.surface_offset = caster.surface_offset
        self.tinted = caster.tinted

    @property
    def for_lamps(self) -> RayCaster:
        """The caster for the light of lamps; usually this one."""
        found = self._caster.for_lamps
        return self if found is self._caster else found

    @property
    def rays(self) -> int:
        """Rays traced so far, those to lamps among them."""
        return self._caster.rays

    def unoccluded(self, origins: Array, directions: Array, distances: Array) -> Array:
        """See `RayCaster.unoccluded`."""
        return self._caster.unoccluded(origins, directions, distances)

    def passing(self, origins: Array, directions: Array, distances: Array, least: float = 0.0) -> Array:
        """See `RayCaster.passing`."""
        return self._caster.passing(origins, directions, distances, least)

    def passing_colors(
        self, origins: Array, directions: Array, distances: Array, least: float = 0.0
    ) -> Array:
        """See `RayCaster.passing_colors`."""
        return self._caster.passing_colors(origins, directions, distances, least)

    def intersect(self, origins: Array, directions: Array) -> Hits:
        """See `RayCaster.intersect`."""
        return self._layers.owners(self._caster.intersect(origins, directions))


class CutOutCaster:
    """Visibility among triangles of which some are partly opaque.

    triangles (t, 3, 3): World-space corners [m].
    images: Of the same triangles.
    threads: 0 means all cores. Results do not depend on it.
    only (t,) bool: The triangles that rays meet; None for all.
    for_lamps: The caster for the light of lamps, if it differs.
    two_sided (t,) bool: The others' backs are black; None if that does not matter.
    stacks: The coincident cut-outs, if there are any.
    """

    def __init__(
        self,
        triangles: Array,
        images: SurfaceImages,
        threads: int = 0,
        only: Array | None = None,
        for_lamps: RayCaster | None = None,
        two_sided: Array | None = None,
        stacks: Stacks | None = None,
    ) -> None:
        self.own_rays = RayCount()
        self._for_lamps = for_lamps
        self.surface_offset = surface_offset(triangles)
        self._images, self._stacks = images, stacks
        met = np.ones(len(triangles), dtype=bool) if only is None else only
        whole, cut = met & ~images.cut_out, met & images.cut_out
        self.tinted = bool((met & images.tinting).any())
        self._whole_rows = np.append(np.flatnonzero(whole), NO_HIT).astype(np.int32)
        self._cut_rows = np.append(np.flatnonzero(cut), NO_HIT).astype(np.int32)
        sides = (None, None) if two_sided is None else (two_sided[whole], two_sided[cut])
        self._whole = EmbreeCaster(triangles[whole], threads, two_sided=sides[0])
        self._cut = EmbreeCaster(triangles[cut], threads, two_sided=sides[1])

    def __getstate__(self) -> dict[str, Any]:
        """Return what another process needs to make the same caster."""
        return {name: value for name, value in vars(self).items() if name != "own_rays"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self.own_rays = RayCount()

    @property
    def for_lamps(self) -> RayCaster:
        """The caster for the light of lamps; usually this one."""
        return self if self._for_lamps is None else self._for_lamps

    @property
    def rays(self) -> int:
        """Number of rays so far, including those to lamps, each counted once despite cut-outs."""
        return self.own_rays.rays + (0 if self._for_lamps is None else self._for_lamps.rays)

    def unoccluded(self, origins: Array, directions: Array, distances: Array) -> Array:
        """Return (n,) bool: no opaque point lies within `distances` along the unit `directions`."""
        self.own_rays.add(len(origins))
        free = self._whole.unoccluded(origins, directions, distances)
        rows = np.flatnonzero(free)
        reach = distances[rows] * (1.0 - TARGET_SLACK)
        free[rows] = self._first_there(origins[rows], directions[rows], reach).triangle == NO_HIT
        return free

    def passing(self, origins: Array, directions: Array, distances: Array, least: float = 0.0) -> Array:
        """Return (n,) float64 what share of light passes: no chance here, but 1 − opacity of all it meets."""
        if self.tinted:
            return np.asarray(self.passing_colors(origins, directions, distances, least).mean(axis=1))
        self.own_rays.add(len(origins))
        share = self._whole.unoccluded(origins, directions, distances).astype(np.float64)
        free = np.flatnonzero(share)
        ways = self._ways(free, origins, directions, distances * (1.0 - TARGET_SLACK))
        while len(ways.ray):
            at, hits = ways.meet()
            opacity = np.clip(self._images.opacity_at(hits.triangle, hits.barycentric), least, 1.0 - least)
            self._multiply(share, ways.ray[at], 1.0 - opacity)
            _thin_out(share, ways.ray[at], origins, directions, hits.triangle)
            ways.keep(share[ways.ray] > ENDED)
        return share

    def passing_colors(
        self, origins: Array, directions: Array, distances: Array, least: float = 0.0
    ) -> Array:
        """Return (n, 3) float64 the same of each channel."""
        self.own_rays.add(len(origins))
        free = self._whole.unoccluded(origins, directions, distances)
        share = np.repeat(free.astype(np.float64)[:, None], 3, axis=1)
        ways = self._ways(np.flatnonzero(free), origins, directions, distances * (1.0 - TARGET_SLACK))
        while len(ways.ray):
            at, hits = ways.meet()
            passes = self._images.passes_at(hits.triangle, hits.barycentric)
            self._multiply(share, ways.ray[at], np.clip(passes, least, 1.0 - least))
            _thin_out(share, ways.ray[at], origins, directions, hits.triangle)
            ways.keep(share[ways.ray].max(axis=1, initial=0.0) > ENDED)
        return share

    def intersect(self, origins: Array, directions: Array) -> Hits:
        """Return the first opaque point that each ray meets."""
        self.own_rays.add(len(origins))
        hits = self._whole.intersect(origins, directions)
        nearer = self._first_there(origins, directions, hits.distance)
        is_cut = nearer.triangle != NO_HIT
        return Hits(
            np.where(is_cut, nearer.triangle, self._whole_rows[hits.triangle]),
            np.where(is_cut[:, None], nearer.barycentric, hits.barycentric),
            np.where(is_cut, nearer.front, hits.front),
            np.where(is_cut, nearer.distance, hits.distance),
            nearer.tint,
        )

    def _multiply(self, share: Array, ray: Array, by: Array) -> None:
        """Multiply the shares of rays, each of which is there once unless cut-outs coincide."""
        if self._stacks is None:
            share[ray] *= by
        else:
            np.multiply.at(share, ray, by)

    def _first_there(self, origins: Array, directions: Array, reach: Array) -> Hits:
        """Return the first cut-outs within `reach` that stop the rays."""
        count = len(origins)
        triangle = np.full(count, NO_HIT, dtype=np.int32)
        barycentric = np.zeros((count, 2), dtype=np.float32)
        front = np.zeros(count, dtype=bool)
        distance = np.full(count, np.inf, dtype=np.float32)
        tint = np.ones((count, 3), dtype=np.float32) if self.tinted else None
        ways = self._ways(np.arange(count), origins, directions, reach)
        while len(ways.ray):
            at, hits = ways.meet()
            ray = ways.ray[at]
            opacity = self._images.opacity_at(hits.triangle, hits.barycentric)
            stopped_by = opacity >= 1.0
            chance = np.flatnonzero((opacity > 0.0) & ~stopped_by)
            drawn = _drawn(origins[ray[chance]], directions[ray[chance]], hits.triangle[chance])
            stopped_by[chance] = opacity[chance] > drawn
            if tint is not None:
                stopped_by &= ~self._images.clear[hits.triangle]
            stops = np.flatnonzero(stopped_by)
            if self._stacks is not None:
                # Of several in one place the outermost.
                stops = stops[np.unique(at[stops], return_index=True)[1]]
            ended = at[stops]
            if tint is not None:
                self._tint(tint, ray, at, hits, opacity, ends=stops)
            stopped = ways.ray[ended]
            triangle[stopped], distance[stopped] = hits.triangle[stops], hits.distance[stops]
            barycentric[stopped], front[stopped] = hits.barycentric[stops], hits.front[stops]
            going = np.ones(len(ways.ray), dtype=bool)
            going[ended] = False
            ways.keep(going)
        return Hits(triangle, barycentric, front, distance, tint)

    def _tint(self, tint: Array, ray: Array, at: Array, hits: Hits, opacity: Array, ends: Array) -> None:
        """Multiply the tints (n, 3) of rays by what passes the h cut-outs that they met before they ended.

        ray, at (h,) int: The ray of each hit, and the number of its way, sorted.
        ends (e,) int: The hits that stop rays.
        """
        before = np.ones(len(at), dtype=bool)
        row = np.searchsorted(at[ends], at)
        there = row < len(ends)
        there[there] = at[ends][row[there]] == at[there]
        before[there] = np.flatnonzero(there) < ends[row[there]]
        rows = np.flatnonzero(before & self._images.tinting[hits.triangle])
        if len(rows):
            passed = self._images.passes_at(hits.triangle[rows], hits.barycentric[rows])
            chance = np.where(self._images.clear[hits.triangle[rows]], 1.0, 1.0 - opacity[rows])
            np.multiply.at(tint, ray[rows], passed / np.maximum(chance, 1e-6)[:, None])

    def _ways(self, ray: Array, origins: Array, directions: Array, reach: Array) -> _Ways:
        offset, stacks = self.surface_offset, self._stacks
        return _Ways(self._cut, self._cut_rows, offset, stacks, ray, origins, directions, reach)


class _Ways:
    """Rays among cut-outs, from one to the next.

    cut: Of the cut-outs alone.
    rows (c + 1,) int32: The scene's triangle for each of its, and NO_HIT.
    offset: How far beyond a cut-out rays go on [m].
    ray (w,) int: The rays that are still traced.
    origins, directions (n, 3).
    reach (n,).
    ray (w,) int: The rays that are still traced.
    """

    def __init__(
        self,
        cut: RayCaster,
        rows: Array,
        offset: float,
        stacks: Stacks | None,
        ray: Array,
        origins: Array,
        directions: Array,
        reach: Array,
    ) -> None:
        self._cut, self._rows, self._offset, self._stacks = cut, rows, offset, stacks
        self._origins, self._directions, self._reach = origins, directions, reach
        self.ray = ray
        self._gone = np.zeros(len(ray))
        # What each ray met in the last place: rounding may have it met once more.
        self._last = np.full((len(ray), 1), NO_HIT, dtype=np.int32)
        self._layers = 0

    def meet(self) -> tuple[Array, Hits]:
        """Advance rays to the next cut-out; rays that meet none within reach end here.

        Returns at (h,) int: The ray of each hit, sorted.
        Returns hits: h hits: none for a ray that met the cut-out it has just passed, several where cut-outs
            coincide, the outermost first.
        """
        start = self._origins[self.ray] + self._gone[:, None] * self._directions[self.ray]
        hits = self._cut.intersect(start, self._directions[self.ray])
        distance, triangle = self._gone + hits.distance, self._rows[hits.triangle]
        met = (triangle != NO_HIT) & (distance < self._reach[self.ray])
        met &= self._layers < MOST_LAYERS
        self._layers += 1
        self._gone = distance + self._offset
        self.keep(met)
        triangle = triangle[met]
        at = np.flatnonzero((self._last != triangle[:, None]).all(axis=1))
        new = Hits(triangle, hits.barycentric[met], hits.front[met], distance[met]).take(at)
        if self._stacks is None:
            self._last = triangle[:, None]
            return at, new
        hit_row, new = self._stacks.through(new)
        number = np.arange(len(hit_row)) - np.searchsorted(hit_row, hit_row)
        last = np.full((len(triangle), max(self._last.shape[1], int(number.max(initial=0)) + 1)), NO_HIT)
        last[:, : self._last.shape[1]] = self._last
        last[at] = NO_HIT
        last[at[hit_row], number] = new.triangle
        self._last = last
        return at[hit_row], new

    def keep(self, going: Array) -> None:
        """Go on with the rays of a mask."""
        self.ray, self._gone, self._last = self.ray[going], self._gone[going], self._last[going]


def _thin_out(share: Array, ray: Array, origins: Array, directions: Array, triangle: Array) -> None:
    """Decide which rays (h,) that have met triangles (h,) go on though their share is faint, in place.

    share (n,) or (n, 3): The largest channel decides for all.
    """
    left = share[ray] if share.ndim == 1 else share[ray].max(axis=1, initial=0.0)
    rows = np.flatnonzero((left < FAINT) & (left > ENDED))
    # Where cut-outs coincide, the first of them decides.
    rows = rows[np.unique(ray[rows], return_index=True)[1]]
    faint, left = ray[rows], left[rows]
    drawn = _drawn(origins[faint], directions[faint], triangle[rows])
    becomes = np.where(drawn < (left - ENDED) / (FAINT - ENDED), FAINT, ENDED)
    share[faint] = (share[faint].T * (becomes / left)).T


def _drawn(origins: Array, directions: Array, triangle: Array) -> Array:
    """Return (n,) numbers in [0, 1) that look random, each a function of its ray and triangle alone."""
    ray = np.concatenate([origins, directions], axis=1).astype(np.float32).view(np.uint32)
    bits = hash_keys(triangle, 61)
    for column in range(6):
        bits = hash_keys(ray[:, column].astype(np.uint64) << np.uint64(32) | bits, 62)
    return np.asarray(bits * 2.0**-32)
