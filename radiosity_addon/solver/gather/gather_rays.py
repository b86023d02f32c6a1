"""Indirect light at points of a solved scene: rays over hemispheres, and rays aimed at bright elements."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ...base import SILENT, Progress
from ...lights import Lamp
from ...numerics import Array, TakenRows
from .bright_patches import BrightElements
from .element_lookup import ElementLookup
from .final_gather import FinalGather, GatheredHits
from .footprints import Footprints
from .hit_numbers import Resolver
from .retracing import Before, retrace


class Gather:
    """Traces the gather rays of points and keeps what they hit: links at the finest level.

    elements: Which of them are bright, and what is left of them for rays that are not aimed.
    """

    def __init__(self, elements: ElementLookup) -> None:
        self._elements = elements

    def at(
        self,
        points: Footprints,
        surface_normals: Array | TakenRows,
        rays: int,
        resolve: Resolver,
        irradiance: Array | None = None,
        into: tuple[Array, Array | None] | None = None,
        progress: Progress = SILENT,
    ) -> GatheredHits:
        """Trace the rays of points.

        surface_normals (n, 3): `points.normals` shade; a ray that dips below these carries nothing.
        rays: Cosine-distributed ones a point; each stands for a form factor of 1 / rays.
        resolve: Numbers the hits.
        irradiance (n,): What is about expected [W/m²]. None aims at nothing.
        into (n, rays) int32, and (n, rays, 3) float16 or None: Takes the sources and tints, if given.
        """
        gathering = self._gathering(points, surface_normals, rays, resolve)
        if irradiance is None:
            return gathering.trace(None, np.zeros(len(points)), into, progress)
        return gathering.trace(self.bright_elements, irradiance, into, progress)

    def again_at(
        self,
        points: Footprints,
        surface_normals: Array | TakenRows,
        resolve: Resolver,
        before: Before,
        irradiance: Array | None = None,
        progress: Progress = SILENT,
    ) -> GatheredHits:
        """Trace those rays again that something which moved touches; the others stay as they were.

        Parameters are those of `at`; `before` is what the same rays met.
        """
        rays = before.gathered.sources.shape[1]
        gathering = self._gathering(points, surface_normals, rays, resolve)
        if irradiance is None:
            return retrace(gathering, before, None, np.zeros(len(points)), progress)
        return retrace(gathering, before, self.bright_elements, irradiance, progress)

    @property
    def bright(self) -> Array:
        """(e,) bool: the elements that rays are aimed at."""
        found = np.zeros(self._elements.hierarchy.n_elements, dtype=bool)
        found[self.bright_elements.element] = True
        return found

    @cached_property
    def bright_elements(self) -> BrightElements:
        """What rays are aimed at, in proportion to what it sends."""
        return BrightElements(self._elements.hierarchy, self._elements.reflected(), self._unshadowed)

    def _unshadowed(self, points: Array, normals: Array) -> Array:
        """Return (n,) the irradiance straight from lamps were nothing in the way, a mean of the channels."""
        total = np.zeros(len(points))
        for light in self._elements.state.scene.lights:
            if isinstance(light, Lamp):
                total += light.unit_irradiance(points, normals) * light.strength.mean()
        return total

    def _gathering(
        self, points: Footprints, surface_normals: Array | TakenRows, rays: int, resolve: Resolver
    ) -> FinalGather:
        elements = self._elements
        return FinalGather(
            elements.caster,
            points,
            surface_normals,
            rays,
            resolve,
            elements.leaves_of,
            seed=elements.state.settings.seed,
            threads=elements.threads,
            sky=elements.sky,
        )
