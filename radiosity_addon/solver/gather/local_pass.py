"""Irradiance at any point: what texels and probes ask of a solution.

The elements' constants are too coarse to show, so each point looks for itself. Direct
light is the exact unoccluded factor times a visibility from shadow rays (no noise where a
lamp is fully seen or fully hidden). Indirect light is gathered by cosine-distributed rays,
whose hits are looked up in the solution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...base import SILENT, Progress
from ...lights import Lamp, SkyTable
from ...numerics import SHADOW_STEP, Array, Scratch, Stream, tiles
from ...rays import Hits
from ..emitters import EmitterGroup, LightSources, emitter_groups
from ..hierarchy import Hierarchy
from ..state import SolverState
from .bright_patches import BrightElements
from .final_gather import NOTHING, SKY, Gathered, Gathering, Resolver
from .footprints import Footprints, Sampler, SpreadPoints
from .light_gains import LightGains
from .retracing import Before, Retracing
from .soft_shadows import ShadowShare
from .sub_cells import LeafParts

__all__ = ["NOTHING", "SKY", "Footprints", "Gathered", "LocalPass", "Resolver", "Sampler", "values_of"]

NEAR = 0.05
"""Form factor beyond which emissive faces are so near that it may change over a texel."""


@dataclass(frozen=True)
class LightQuery:
    """A lamp or emissive group, its number among `LightGains`, and what places its shadow rays."""

    light: Lamp | EmitterGroup
    number: int
    seed: int


class LocalPass:
    """Asks for the light at points of a solved scene.

    Parameters
    ----------
    state : SolverState
    sources : LightSources or None
        Given, every light can be asked for apart (`LightGains`), for relighting.
    """

    def __init__(self, state: SolverState, sources: LightSources | None = None) -> None:
        self._state = state
        self.sources = sources
        self.caster = state.caster
        """Casts this scene's rays."""
        self._seed = state.settings.seed
        self.threads = state.settings.threads
        """0 means all cores."""
        self.emitters = (
            emitter_groups(state.scene, state.hierarchy.faces, state.caster)
            if sources is None
            else sources.groups
        )

    def with_irradiance(self, irradiance: Array) -> LocalPass:
        """Return the same with other light at the elements, (e, 3) [W/m²]."""
        return LocalPass(replace(self._state, irradiance=irradiance), self.sources)

    def direct(
        self,
        at: Footprints,
        rays: int | None = None,
        gains: LightGains | None = None,
        total: Array | None = None,
        tell: Callable[[], None] | None = None,
        progress: Progress = SILENT,
    ) -> Array:
        """Compute the irradiance straight from lamps and emissive surfaces, the sky's apart.

        Parameters
        ----------
        at : Footprints
        rays : int or None
            Shadow rays a point and lamp; None takes the settings'.
        gains : LightGains or None
            If given, takes what every light adds: lamps by their number among the scene's lights, those
            without strength too, then emissive groups. Each is asked as if it were the only one, which
            it may become.
        total : (n, 3) float64 or None
            If given, all 0, the result grows in it, one light after the other, …
        tell : callable or None
            … and this is called after each.

        Returns
        -------
        irradiance : (n, 3) float64 [W/m²]
        """
        total = at.scratch.zeros((len(at), 3)) if total is None else total
        lights = self.lights(dark=gains is not None)
        if gains is not None:
            at = replace(at, expected=None)
        spread = SpreadPoints(at, self._seed + Stream.FOOTPRINT, self.threads)
        for asked, part in progress.each(lights):
            arriving = self._arriving(asked, spread, rays, part)
            for rows in tiles(len(total)):
                total[rows] += arriving[rows, None] * asked.light.strength
            if gains is not None:
                gains.put(asked.number, arriving)
            if tell is not None:
                tell()
        return total

    def lights(self, dark: bool = True) -> list[LightQuery]:
        """Return the lamps, if they are `dark` as well, and the emissive groups that shine on points."""
        lamps = [
            (number, lit)
            for number, lit in enumerate(self._state.scene.lights)
            if isinstance(lit, Lamp) and (dark or lit.strength.any())
        ]
        first, seed = len(self._state.scene.lights), self._seed
        of_lamps, of_groups = seed + Stream.LAMP_SHADOWS, seed + Stream.EMITTER_SHADOWS
        step = SHADOW_STEP
        asked = [LightQuery(lit, row, of_lamps + step * place) for place, (row, lit) in enumerate(lamps)]
        groups = enumerate(self.emitters)
        return asked + [LightQuery(lit, first + place, of_groups + step * place) for place, lit in groups]

    def gain(
        self, asked: LightQuery, at: Footprints, rays: int | None = None, progress: Progress = SILENT
    ) -> Array:
        """Return (n,) what one light adds per unit of its strength, as if it were the only one."""
        spread = SpreadPoints(replace(at, expected=None), self._seed + Stream.FOOTPRINT, self.threads)
        return self._arriving(asked, spread, rays, progress)

    def _arriving(
        self, asked: LightQuery, spread: SpreadPoints, rays: int | None, progress: Progress
    ) -> Array:
        """Return (n,) unoccluded irradiance per unit of a light's strength times visibility."""
        light, shadow_rays = asked.light, rays or self._state.settings.shadow_rays
        glows = isinstance(light, EmitterGroup)
        caster = self.caster if glows else self.caster.for_lamps
        gain = spread.gain(light, NEAR if glows else 0.0, progress.part(0.0, 0.1))
        share = ShadowShare(caster, light, spread, asked.seed, self.threads)
        unblocked = share.at_points(gain, shadow_rays, progress.part(0.1, 1.0))
        for rows in tiles(len(gain)):
            gain[rows] *= unblocked[rows]
        return gain

    def lit_by(self, gains: LightGains) -> Array:
        """Return (n, 3) what arrives [W/m²] by gains, of the strengths that the sources have."""
        assert self.sources is not None  # else there are no gains
        return gains.irradiance(self.sources.of_lamps(self.sources.strengths))

    def new_gains(self, count: int, scratch: Scratch | None = None) -> LightGains | None:
        """Return where `count` points keep each light apart; None if lights cannot be asked for apart."""
        return None if self.sources is None else LightGains(count, scratch)

    def gather(
        self,
        at: Footprints,
        surface_normals: Array,
        rays: int,
        resolve: Resolver,
        irradiance: Array | None = None,
        into: Array | None = None,
        progress: Progress = SILENT,
    ) -> Gathered:
        """Trace rays over hemispheres, and rays aimed at bright elements: links at the finest level.

        Parameters
        ----------
        at : Footprints
        surface_normals : (n, 3) float64
            `at.normals` shade; a ray that dips below `surface_normals` carries nothing.
        rays : int
            Cosine-distributed ones a point; each stands for a form factor of 1 / rays.
        resolve : callable
            Numbers the hits.
        irradiance : (n,) float64 or None [W/m²]
            What is about expected. None aims at nothing.
        into : (n, rays) int32 or None
            Takes the sources, if given.
        """
        gathering = self._gathering(at, surface_normals, rays, resolve)
        if into is not None:
            gathering.sources = into
        if irradiance is None:
            return gathering.trace(None, np.zeros(len(at)), progress)
        return gathering.trace(self.bright_elements, irradiance, progress)

    def regather(
        self,
        at: Footprints,
        surface_normals: Array,
        resolve: Resolver,
        before: Before,
        irradiance: Array | None = None,
        progress: Progress = SILENT,
    ) -> Gathered:
        """Trace those rays again that something which moved touches; the others stay as they were.

        Parameters are those of `gather`; `before` is what the same rays met.
        """
        rays = before.gathered.sources.shape[1]
        retracing = Retracing(self._gathering(at, surface_normals, rays, resolve), before)
        if irradiance is None:
            return retracing.trace(None, np.zeros(len(at)), progress)
        return retracing.trace(self.bright_elements, irradiance, progress)

    def _gathering(self, at: Footprints, surface_normals: Array, rays: int, resolve: Resolver) -> Gathering:
        return Gathering(
            self.caster,
            at,
            surface_normals,
            rays,
            resolve,
            self.leaves_of,
            seed=self._seed,
            threads=self.threads,
            sky=self._sky,
        )

    @cached_property
    def bright_elements(self) -> BrightElements:
        """What rays are aimed at, and how."""
        return BrightElements(self._state.hierarchy, self.reflected(), self._unshadowed)

    @property
    def bright(self) -> Array:
        """(e,) bool: the elements that rays are aimed at."""
        found = np.zeros(self.hierarchy.n_elements, dtype=bool)
        found[self.bright_elements.element] = True
        return found

    def _unshadowed(self, points: Array, normals: Array) -> Array:
        """Return (n,) the irradiance straight from lamps were nothing in the way, a mean of the channels."""
        total = np.zeros(len(points))
        for light in self._state.scene.lights:
            if isinstance(light, Lamp):
                total += light.unit_irradiance(points, normals) * light.strength.mean()
        return total

    def leaves_of(self, hits: Hits) -> Array:
        """Return (n,) int32: the leaf element under each hit; NOTHING for none or a black back."""
        hierarchy = self._state.hierarchy
        face = hierarchy.faces.of_triangle[(~hits.front).astype(np.int8), hits.triangle]
        on_face = (hits.triangle >= 0) & (face >= 0)
        leaf = np.full(len(face), NOTHING, dtype=np.int32)
        leaf[on_face] = hierarchy.leaf_at(face[on_face], hits.barycentric[on_face])
        return leaf

    def leaf_areas(self, hits: Hits) -> Array:
        """Return (n,) float64 the area of the leaf element under each hit [m²]; endless for none."""
        leaf = self.leaves_of(hits)
        return np.asarray(np.where(leaf == NOTHING, np.inf, self._state.hierarchy.area[leaf]))

    def reflected(self, irradiance: Array | None = None) -> Array:
        """Return (e, 3): the part of every element's radiosity it does not emit itself [W/m²].

        Where its surface is there, as it is for rays that hit it. Of the solution's irradiance, or
        another (e, 3) one.
        """
        every = np.arange(self._state.hierarchy.n_elements)
        arriving = self._state.irradiance if irradiance is None else irradiance
        return np.asarray(self._reflectance_where_hit(every) * arriving)

    @property
    def irradiance(self) -> Array:
        """(e, 3) float64: the elements' irradiance [W/m²]."""
        return self._state.irradiance

    def irradiance_at(self, triangle: Array, barycentric: Array) -> Array:
        """Return (n,) the elements' irradiance at points of triangles' fronts, a mean of the channels [W/m²].

        `barycentric` (n, 2) are weights of corners 2 and 3.
        """
        return values_of(self._mean_irradiance, self.leaf_at_fronts(triangle, barycentric))

    @cached_property
    def _mean_irradiance(self) -> Array:
        return np.asarray(self._state.irradiance.mean(axis=1))

    @property
    def state(self) -> SolverState:
        """What was solved."""
        return self._state

    @property
    def hierarchy(self) -> Hierarchy:
        """The elements that hits are numbered by."""
        return self._state.hierarchy

    def leaf_at_fronts(self, triangle: Array, barycentric: Array) -> Array:
        """Return (n,) int32 the leaf elements at such points, or NOTHING where there is none."""
        hierarchy = self._state.hierarchy
        face = hierarchy.faces.of_triangle[0, triangle]
        on_face = face >= 0
        leaf = np.full(len(face), NOTHING, dtype=np.int32)
        leaf[on_face] = hierarchy.leaf_at(face[on_face], barycentric[on_face])
        return leaf

    @cached_property
    def parts(self) -> LeafParts:
        """The parts of leaf elements that rays may hit."""
        return LeafParts(self._state.hierarchy, self.caster)

    def parts_of(self, hits: Hits) -> Array:
        """Return (n,) int32: the part of a leaf element under each hit; NOTHING for none or a black back."""
        return self.parts.at(self.leaves_of(hits), hits)

    def gather_at_parts(
        self, parts: Array, rays: int, resolve: Resolver, progress: Progress = SILENT
    ) -> Array:
        """Gather over whole parts instead of points; return (p, rays) sources."""
        at = self.parts.footprints(parts)
        return self.gather(at, at.normals, rays, resolve, progress=progress).sources

    def part_reflectance(self, parts: Array) -> Array:
        """Return (p, 3) the reflectance of parts of leaf elements where their surface is there."""
        return self._reflectance_where_hit(self.parts.leaf_of(parts))

    def _reflectance_where_hit(self, elements: Array) -> Array:
        hierarchy = self._state.hierarchy
        return np.asarray(hierarchy.reflectance[elements] / hierarchy.opacity_where_hit[elements, None])

    def lit_parts(self, parts: Array) -> Footprints:
        """Return parts as footprints that ask for lamps, and what elements lead them to expect."""
        expected = self._state.irradiance[self.parts.leaf_of(parts)].mean(axis=1)
        return replace(self.parts.footprints(parts), expected=expected)

    def beyond(self, sky: SkyTable | None = None) -> Array:
        """Return (cells + 2, 3) the last rows of a table of radiosity [W/m²]: the sky's cells, and two dark.

        So the negative numbers of what rays found index them. Of the scene's sky, or another with the
        same cells.
        """
        assert (NOTHING, SKY) == (-2, -3)
        return np.concatenate([(sky or self._sky).radiosity[::-1], np.zeros((2, 3))])

    @cached_property
    def _sky(self) -> SkyTable:
        return SkyTable(self._state.scene.lights)


def values_of(values: Array, elements: Array) -> Array:
    """Return the (e, …) values at elements (n,); 0 at NOTHING."""
    found = np.zeros((len(elements), *values.shape[1:]))
    there = elements != NOTHING
    found[there] = values[elements[there]]
    return found
