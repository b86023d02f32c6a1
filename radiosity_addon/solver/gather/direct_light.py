"""Direct light at points of a solved scene, of all lights together or of each apart.

It is the exact unoccluded factor times a visibility from shadow rays: no noise where a lamp is fully seen or
fully hidden.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...base import SILENT, Progress
from ...lights import Emitter, Lamp, LampTable, light_strengths
from ...numerics import SHADOW_STEP, Array, Scratch, Stream, tiles
from ..emitters import EmitterGroup, LightSources, emitter_groups
from ..state import SolverState
from .footprints import SPREAD, Footprints, SpreadPoints
from .group_shadows import shadow_share
from .light_gains import CompactGains, LightGains
from .lone_shadows import SHARED_STARTS, LoneShadowShare, one_lamp
from .run_gains import MOST_RUNS, RUNS, RunGains, ask_runs
from .soft_shadows import ShadowShare

NEAR_FACTOR = 0.05
"""Form factor beyond which emissive faces are so near that it may change over a texel."""


@dataclass(frozen=True)
class LightQuery:
    """A lamp or emissive group, its number among `LightGains`, and what places its shadow rays."""

    light: Lamp | EmitterGroup
    number: int
    seed: int


class DirectLight:
    """Light straight from lamps and emissive surfaces; the sky's is gathered.

    sources: Given, gains of every light can be kept apart (`LightGains`), for relighting.
    part: Of the rays of a single one, what each of many lamps has that are kept apart (`part_of_rays`); 0 if
        they are few.
    """

    def __init__(self, state: SolverState, sources: LightSources | None = None, part: float = 0.0) -> None:
        self._state, self.sources, self.part = state, sources, part
        self.emitters = (
            emitter_groups(state.scene, state.hierarchy.faces, state.caster)
            if sources is None
            else sources.groups
        )

    @property
    def many(self) -> bool:
        """Whether lamps are kept apart that are many."""
        return self.part > 0.0

    def at(
        self,
        points: Footprints,
        rays: int | None = None,
        gains: LightGains | None = None,
        total: Array | None = None,
        on_light: Callable[[], None] | None = None,
        progress: Progress = SILENT,
    ) -> Array:
        """Return (n, 3) float64 the irradiance at points [W/m²].

        rays: Shadow rays a point and lamp; None takes the settings'.
        gains: If given, takes what every light adds: lamps by their number among the scene's lights, those
            without strength too, then emissive groups. Each is measured as if it were the only one, which
            it may become.
        total (n, 3): If given, all 0, the result grows in it, one light after the other, …
        on_light: … and this is called after each.
        """
        total = points.scratch.zeros((len(points), 3)) if total is None else total
        lights = self.lights(include_dark_lights=gains is not None)
        if gains is not None:
            points = replace(points, expected=None)
        spread = self._spread(points)
        if isinstance(gains, RunGains):
            progress, of_runs = progress.part(0.0, 0.3), progress.part(0.3, 1.0)
            in_runs = set(gains.numbers.tolist())
            lights = [query for query in lights if query.number not in in_runs]
            settings, caster = self._state.settings, self._state.caster.for_lamps
            seed = settings.seed + Stream.LAMP_SHADOWS
            ask_runs(gains, caster, spread, seed, settings.threads, of_runs)
            total += gains.irradiance(light_strengths(self._state.scene.lights))
        for query, part in progress.each(lights):
            arriving = self._arriving(query, spread, rays, part)
            for rows in tiles(len(total)):
                gain = arriving[rows] if arriving.ndim == 2 else arriving[rows, None]
                total[rows] += gain * query.light.strength
            if gains is not None:
                gains.put(query.number, arriving)
            if on_light is not None:
                on_light()
        return total

    def lights(self, include_dark_lights: bool = True) -> list[LightQuery]:
        """Return the lamps and emissive groups that shine on points."""
        lamps = [
            (number, lit)
            for number, lit in enumerate(self._state.scene.lights)
            if isinstance(lit, Lamp) and (include_dark_lights or lit.strength.any())
        ]
        first, seed, step = len(self._state.scene.lights), self._state.settings.seed, SHADOW_STEP
        of_lamps, of_groups = seed + Stream.LAMP_SHADOWS, seed + Stream.EMITTER_SHADOWS
        lamps_asked = [
            LightQuery(lit, row, of_lamps + step * place) for place, (row, lit) in enumerate(lamps)
        ]
        groups = enumerate(self.emitters)
        return lamps_asked + [
            LightQuery(lit, first + place, of_groups + step * place) for place, lit in groups
        ]

    def gain(
        self, asked: LightQuery, points: Footprints, rays: int | None = None, progress: Progress = SILENT
    ) -> Array:
        """Return what one light adds per unit of its strength, as if it were alone; see `_arriving`."""
        return self._arriving(asked, self._spread(replace(points, expected=None)), rays, progress)

    def _spread(self, points: Footprints) -> SpreadPoints:
        settings = self._state.settings
        count = SHARED_STARTS if self.many else SPREAD
        return SpreadPoints(points, settings.seed + Stream.FOOTPRINT, settings.threads, count)

    def _arriving(
        self, asked: LightQuery, spread: SpreadPoints, rays: int | None, progress: Progress
    ) -> Array:
        """Return (n,) unoccluded irradiance per unit of a light's strength times visibility.

        (n, 3) by channel where its light may pass glass.
        """
        light, settings = asked.light, self._state.settings
        glows = isinstance(light, EmitterGroup)
        caster = self._state.caster if glows else self._state.caster.for_lamps
        if self.many and isinstance(light, Emitter):
            gain = spread.gain(one_lamp(light), progress=progress.part(0.0, 0.1))
            share: ShadowShare = LoneShadowShare(
                caster, light, spread, asked.seed, settings.threads, self.part
            )
        else:
            gain = spread.gain(light, NEAR_FACTOR if glows else 0.0, progress.part(0.0, 0.1))
            share = shadow_share(caster, light, spread, asked.seed, settings.threads)
        unblocked = share.at_points(gain, rays or settings.shadow_rays, progress.part(0.1, 1.0))
        if unblocked.ndim == 2:
            for rows in tiles(len(gain)):
                unblocked[rows] *= gain[rows, None]
            return unblocked
        for rows in tiles(len(gain)):
            gain[rows] *= unblocked[rows]
        return gain

    def lit_by(self, gains: LightGains) -> Array:
        """Return (n, 3) what arrives [W/m²] by gains, of the strengths that the sources have."""
        assert self.sources is not None  # else there are no gains
        return gains.irradiance(self.sources.of_lamps(self.sources.strengths))

    def new_gains(self, count: int, scratch: Scratch | None = None) -> LightGains | None:
        """Return where `count` points keep each light apart; None if lights are not kept apart."""
        if self.sources is None:
            return None
        return CompactGains(count, scratch) if self.many else LightGains(count, scratch)

    def new_cell_gains(self, points: Footprints, rays: int) -> LightGains | None:
        """Return the same for cells, which answer rays: many lamps by runs (`RunGains`).

        rays: To every lamp, if there are few.
        """
        if not self.many:
            return self.new_gains(len(points))
        lights = self._state.scene.lights
        lamps = [
            (number, lit)
            for number, lit in enumerate(lights)
            if isinstance(lit, Emitter) and lit.casts_shadow
        ]
        order = LampTable([lamp for _, lamp in lamps]).order
        numbers = np.array([number for number, _ in lamps], dtype=np.int32)[order]
        channels = (3,) if self._state.caster.for_lamps.tinted else ()
        chosen = [lamps[row][1] for row in order]
        runs = min(RUNS * rays, MOST_RUNS)
        at, normals = np.asarray(points.points), np.asarray(points.normals)
        return RunGains(at, normals, chosen, numbers, runs, channels)
