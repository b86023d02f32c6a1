"""The elements of a solved scene as rays and points find them, and the light that they have."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ...lights import SkyTable
from ...numerics import Array
from ...rays import Hits, RayCaster
from ..hierarchy import Hierarchy
from ..state import SolverState
from .hit_numbers import NOTHING, table_end, values_of


class ElementLookup:
    """Looks up elements below hits and points.

    state: Was solved; its hierarchy is not refined any more.
    """

    def __init__(self, state: SolverState) -> None:
        self.state = state

    @property
    def hierarchy(self) -> Hierarchy:
        """The elements that hits are numbered by."""
        return self.state.hierarchy

    @property
    def caster(self) -> RayCaster:
        """Casts this scene's rays."""
        return self.state.caster

    @property
    def threads(self) -> int:
        """0 means all cores."""
        return self.state.settings.threads

    @property
    def irradiance(self) -> Array:
        """(e, 3) float64: the elements' irradiance [W/m²]."""
        return self.state.irradiance

    @cached_property
    def sky(self) -> SkyTable:
        """What rays that leave the scene find."""
        return SkyTable(self.state.scene.lights)

    def leaves_of(self, hits: Hits) -> Array:
        """Return (n,) int32: the leaf element under each hit; NOTHING for none or a black back."""
        side = (~hits.front).astype(np.int8)
        return self._leaves(side, hits.triangle, hits.barycentric, hits.triangle >= 0)

    def leaf_at_fronts(self, triangle: Array, barycentric: Array) -> Array:
        """Return (n,) int32 the leaf elements at points of triangles' fronts, or NOTHING.

        `barycentric` (n, 2) are weights of corners 2 and 3.
        """
        return self._leaves(0, triangle, barycentric, True)

    def _leaves(self, side: Array | int, triangle: Array, barycentric: Array, hit: Array | bool) -> Array:
        face = self.hierarchy.faces.of_triangle[side, triangle]
        on_face = (face >= 0) & hit
        leaf = np.full(len(face), NOTHING, dtype=np.int32)
        leaf[on_face] = self.hierarchy.leaf_at(face[on_face], barycentric[on_face])
        return leaf

    def leaf_areas(self, hits: Hits) -> Array:
        """Return (n,) float64 the area of the leaf element under each hit [m²]; infinite for none."""
        leaf = self.leaves_of(hits)
        return np.asarray(np.where(leaf == NOTHING, np.inf, self.hierarchy.area[leaf]))

    def irradiance_at(self, triangle: Array, barycentric: Array) -> Array:
        """Return (n,) the elements' irradiance at such points, a mean of the channels [W/m²]."""
        return values_of(self._mean_irradiance, self.leaf_at_fronts(triangle, barycentric))

    @cached_property
    def _mean_irradiance(self) -> Array:
        return np.asarray(self.irradiance.mean(axis=1))

    def reflected(self, irradiance: Array | None = None) -> Array:
        """Return (e, 3): the part of every element's radiosity it does not emit itself [W/m²].

        Where its surface is there, as it is for rays that hit it. Of the solution's irradiance, or
        another (e, 3) one.
        """
        arriving = self.irradiance if irradiance is None else irradiance
        return np.asarray(self.reflectance_of(np.arange(self.hierarchy.n_elements)) * arriving)

    def reflected_of(self, elements: Array) -> Array:
        """Return (n, 3) the same of some elements alone; 0 at NOTHING [W/m²]."""
        found = np.zeros((len(elements), 3))
        there = elements != NOTHING
        asked = elements[there]
        found[there] = self.reflectance_of(asked) * self.irradiance[asked]
        return found

    def reflectance_of(self, elements: Array) -> Array:
        """Return (k, 3) the reflectance of elements where their surface is there."""
        hierarchy = self.hierarchy
        return np.asarray(hierarchy.reflectance[elements] / hierarchy.opacity_where_hit[elements, None])

    def beyond(self) -> Array:
        """Return the last rows of a table of radiosity (see `table_end`)."""
        return table_end(self.sky)
