"""Irradiance at any point: what texels and probes ask of a solution.

The elements' constants are too coarse to show, so each point looks for itself. Direct
light is the exact unoccluded factor times a visibility from shadow rays (no noise where a
lamp is fully seen or fully hidden). Indirect light is gathered by cosine-distributed rays,
whose hits are looked up in the solution.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from .arrays import Array
from .emitters import EmitterGroup
from .lights import EnvironmentLight, Lamp
from .parallel import for_chunks
from .sampling import cosine_hemisphere, points_on_triangles, stratified_square, to_world
from .visibility import Hits

if TYPE_CHECKING:
    from .methods.hierarchical import HierarchicalState

CHUNK_RAYS = 1 << 18
"""Rays a thread prepares at once; bounds its temporaries to about 40 MB."""

MORE_SHADOW_RAYS = 8
"""Times as many shadow rays where the first disagree."""

PENUMBRA_STEPS = 32
"""How far, in neighbours, a penumbra is followed from where few rays found it."""

Sampler = Callable[[Array, Array], Array]
"""(rows, u (r, k, 2)) → (r, k, 3): points of the rows' footprints."""

Resolver = Callable[[Hits], Array]
"""Hits → (n,) int32: the number under which a hit's radiosity will be looked up; SKY for none."""

SKY = -1
NOTHING = -2
"""A gather ray that left through the surface it started on: it carries no light."""


class LocalPass:
    """Asks for the light at points of a solved scene."""

    def __init__(self, state: HierarchicalState) -> None:
        self._state = state
        self.caster = state.caster
        """Casts this scene's rays."""
        self._seed = state.settings.seed
        self.threads = state.settings.threads
        """0 means all cores."""
        self.emitters = EmitterGroup.of_faces(state.hierarchy.faces, state.caster)

    def direct(
        self,
        points: Array,
        normals: Array,
        keys: Array,
        sampler: Sampler | None = None,
        near: Callable[[Array], Array] | None = None,
        rays: int | None = None,
    ) -> Array:
        """Return the irradiance straight from lamps and emissive surfaces, the sky's apart.

        Parameters
        ----------
        points, normals : (n, 3) float64
            Centres of the footprints, unit normals.
        keys : (n,) int
            With the seed, what places each point's samples.
        sampler : callable or None
            Spreads the samples over each point's footprint; None keeps them at the point.
        near : callable or None
            Grows a (n,) mask of doubtful points to their neighbours, which then also get the
            larger number of rays.
        rays : int or None
            Shadow rays a point and lamp; None takes the settings'.

        Returns
        -------
        irradiance : (n, 3) float64 [W/m²]
        """
        total = np.zeros((len(points), 3))
        shadow_rays = rays or self._state.settings.shadow_rays
        for number, light in enumerate(self._state.scene.lights):
            if not isinstance(light, Lamp) or not light.strength.any():
                continue
            seed = self._seed + 31 + 7 * number
            gain = self._mean_gain(light, points, normals, keys, sampler, seed)
            share = self._share(light, points, normals, gain > 0, keys, sampler, near, shadow_rays, seed)
            total += (gain * share)[:, None] * light.strength
        for number, group in enumerate(self.emitters):
            seed = self._seed + 17 + 7 * number
            gain = group.unit_irradiance(points, normals)
            share = self._share(group, points, normals, gain > 0, keys, sampler, near, shadow_rays, seed)
            total += (gain * share)[:, None] * group.strength
        return total

    def _mean_gain(
        self, light: Lamp, points: Array, normals: Array, keys: Array, sampler: Sampler | None, seed: int
    ) -> Array:
        """Return (n,) the unoccluded irradiance per unit of strength, a mean over the footprint."""
        if sampler is None:
            return light.unit_irradiance(points, normals)
        rows = np.arange(len(points))
        spread = sampler(rows, stratified_square(keys, 4, seed)).reshape(-1, 3)
        return np.asarray(
            light.unit_irradiance(spread, np.repeat(normals, 4, axis=0)).reshape(-1, 4).mean(axis=1)
        )

    def _share(
        self,
        light: Lamp | EmitterGroup,
        points: Array,
        normals: Array,
        facing: Array,
        keys: Array,
        sampler: Sampler | None,
        near: Callable[[Array], Array] | None,
        rays: int,
        seed: int,
    ) -> Array:
        """Return (n,) the unblocked share: few rays everywhere, many in penumbrae."""
        lit, total = np.zeros(len(points)), np.zeros(len(points))
        self._shadow(light, points, normals, np.flatnonzero(facing), keys, sampler, rays, seed, lit, total)
        # Few rays miss the faint ends of a penumbra: where many rays found one, ask around it.
        many = np.zeros(len(points), dtype=bool)
        for _ in range(PENUMBRA_STEPS):
            share = lit / np.where(total > 0, total, 1.0)
            partial = facing & (share > 1e-6) & (share < 1 - 1e-6)
            if near is not None:
                partial = near(partial) | (near(facing & (share > 0.5)) & near(facing & (share <= 0.5)))
            rows = np.flatnonzero(partial & facing & ~many)
            if len(rows) == 0:
                break
            many[rows] = True
            lit[rows] = total[rows] = 0.0
            more = rays * MORE_SHADOW_RAYS
            self._shadow(light, points, normals, rows, keys, sampler, more, seed, lit, total)
        return np.asarray(lit / np.where(total > 0, total, 1.0))

    def _shadow(
        self,
        light: Lamp | EmitterGroup,
        points: Array,
        normals: Array,
        rows: Array,
        keys: Array,
        sampler: Sampler | None,
        count: int,
        seed: int,
        lit: Array,
        total: Array,
    ) -> None:
        """Add `count` shadow rays a row to the sums of unblocked and of all weights."""

        def trace(part: slice) -> None:
            chunk = rows[part]
            at, normal = points[chunk], normals[chunk]
            unit = stratified_square(keys[chunk], count, seed + 1)
            directions, distances, weights = light.shadow_rays(at, normal, unit)
            start = np.repeat(at[:, None], count, axis=1)
            if sampler is not None:
                # The same lamp points, seen from points spread over the footprint.
                start = sampler(chunk, stratified_square(keys[chunk], count, seed + 2))
                finite = np.isfinite(distances)[..., None]
                reach = np.where(finite, distances[..., None], 1.0)
                along = np.where(finite, at[:, None] + directions * reach - start, directions)
                length = np.linalg.norm(along, axis=2)
                directions = along / np.maximum(length, 1e-300)[..., None]
                distances = np.where(finite[..., 0], length, np.inf)
            start = start + self.caster.surface_offset * normal[:, None]
            point, sample = np.nonzero(weights > 0)
            at = (point, sample)
            free = self.caster.visible(start[at], directions[at], distances[at])
            lit[chunk] += np.bincount(point, free * weights[point, sample], minlength=len(chunk))
            total[chunk] += weights.sum(axis=1)

        for_chunks(trace, len(rows), max(CHUNK_RAYS // count, 1), self.threads)

    def gather(
        self,
        points: Array,
        normals: Array,
        surface_normals: Array,
        keys: Array,
        rays: int,
        resolve: Resolver,
        sampler: Sampler | None = None,
    ) -> tuple[Array, Array]:
        """Trace cosine-distributed rays and keep what they hit: links at the finest level.

        Parameters
        ----------
        points, normals, surface_normals : (n, 3) float64
            `normals` shade; a ray that dips below `surface_normals` carries nothing.
        rays : int
            A point; each stands for a form factor of 1 / rays.
        resolve : callable
            Numbers the hits.

        Returns
        -------
        sources : (n, rays) int32
            What `resolve` said; SKY where nothing was hit, NOTHING below the surface.
        closeness : (n,) float64
            Mean of 1/distance over the rays [1/m]: how quickly irradiance may change.
        """
        sources = np.empty((len(points), rays), dtype=np.int32)
        closeness = np.empty(len(points))

        def trace(part: slice) -> None:
            rows = np.arange(part.start, part.stop)
            unit = stratified_square(keys[rows], rays, self._seed + 3)
            directions = to_world(cosine_hemisphere(unit), normals[rows])
            start = np.repeat(points[rows][:, None], rays, axis=1)
            if sampler is not None:
                start = sampler(rows, stratified_square(keys[rows], rays, self._seed + 4))
            start = start + self.caster.surface_offset * surface_normals[rows][:, None]
            hits = self.caster.first_hits(start.reshape(-1, 3), directions.reshape(-1, 3))
            found = np.where(hits.triangle < 0, SKY, resolve(hits))
            below = np.einsum("nrk,nk->nr", directions, surface_normals[rows]) <= 0
            sources[rows] = np.where(below, NOTHING, found.reshape(len(rows), rays))
            inverse = 1.0 / np.maximum(hits.distance.reshape(len(rows), rays), self.caster.surface_offset)
            closeness[rows] = inverse.mean(axis=1)

        for_chunks(trace, len(points), max(CHUNK_RAYS // rays, 1), self.threads)
        return sources, closeness

    def leaves_of(self, hits: Hits) -> Array:
        """Return (n,) int32: the leaf element under each hit; SKY for none or a black back."""
        hierarchy = self._state.hierarchy
        face = hierarchy.faces.of_triangle[(~hits.front).astype(np.int8), hits.triangle]
        on_face = (hits.triangle >= 0) & (face >= 0)
        leaf = np.full(len(face), NOTHING, dtype=np.int32)
        leaf[on_face] = hierarchy.leaf_at(face[on_face], hits.barycentric[on_face])
        return leaf

    def reflected(self) -> Array:
        """Return (e, 3): the part of every element's radiosity it does not emit itself [W/m²]."""
        hierarchy = self._state.hierarchy
        return np.asarray(hierarchy.faces.reflectance[hierarchy.face] * self._state.irradiance)

    def reflected_at(self, triangle: Array, barycentric: Array) -> Array:
        """Return (n, 3): the same at points of triangles' fronts, (n, 2) weights of corners 2 and 3."""
        hierarchy = self._state.hierarchy
        face = hierarchy.faces.of_triangle[0, triangle]
        leaf = hierarchy.leaf_at(np.maximum(face, 0), barycentric)
        return np.where((face >= 0)[:, None], self.reflected()[leaf], 0.0)

    def gather_at_leaves(self, leaves: Array, rays: int, resolve: Resolver) -> tuple[Array, Array]:
        """Gather over whole leaf elements instead of points: (l, rays) sources and (l,) closeness."""
        corners = self._state.hierarchy.corners[leaves]
        normals = self._state.hierarchy.normal[leaves]
        return self.gather(
            corners.mean(axis=1),
            normals,
            normals,
            leaves,
            rays,
            resolve,
            lambda rows, u: points_on_triangles(corners[rows], u),
        )

    def leaf_reflectance(self, leaves: Array) -> Array:
        """Return (l, 3) the reflectance of leaf elements."""
        hierarchy = self._state.hierarchy
        return np.asarray(hierarchy.faces.reflectance[hierarchy.face[leaves]])

    def leaf_direct(self, leaves: Array) -> Array:
        """Return (l, 3) the irradiance of leaf elements straight from lamps and emissive faces."""
        corners = self._state.hierarchy.corners[leaves]
        return self.direct(
            corners.mean(axis=1),
            self._state.hierarchy.normal[leaves],
            leaves,
            lambda rows, u: points_on_triangles(corners[rows], u),
            rays=16,
        )

    def sky(self) -> Array:
        """Return (3,) the radiosity equivalent πL of the sky [W/m²]."""
        lights = self._state.scene.lights
        skies = [light.strength for light in lights if isinstance(light, EnvironmentLight)]
        return np.asarray(np.pi * np.sum(skies, axis=0)) if skies else np.zeros(3)
