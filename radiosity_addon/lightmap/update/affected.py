"""What of a lit scene may change when some of its triangles move: texels, and what rays hit.

Whatever is not named here is as it was. All is judged to the safe side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...numerics import Array
from ...rays import SIGHT_LIFT, EmbreeCaster, RayCaster
from ...solver.gather import UNNUMBERED, Boxes, ElementCells, ElementLookup, MovedGeometry
from ..texels import Crossings, SmoothLift, TexelGeometry
from ..transport import HitTable

AFFECTED_REACH = 1.5
"""What is farther from a texel than this many times its size neither touches nor hoods it."""

BOX_MARGIN = 4.0
"""Boxes are this many surface offsets larger than what moved."""


@dataclass(frozen=True, eq=False)
class AffectedTexels:
    """Some triangles moved.

    Attributes
    ----------
    before, geometry : TexelGeometry
        As it was, and is.
    moved : (t,) bool
        Triangles that are elsewhere.
    boxes : Boxes
        Around them, where they were and where they are.
    """

    before: TexelGeometry
    geometry: TexelGeometry
    moved: Array
    boxes: Boxes

    @staticmethod
    def of(
        before: TexelGeometry, geometry: TexelGeometry, parts: list[Array], offset: float
    ) -> AffectedTexels:
        """Compare texels; `parts` are the rows of the triangles of each object that moved."""
        moved = np.zeros(len(geometry.triangles), dtype=bool)
        for rows in parts:
            moved[rows] = True
        places = [triangles[rows] for rows in parts for triangles in (before.triangles, geometry.triangles)]
        return AffectedTexels(before, geometry, moved, Boxes.around(places, BOX_MARGIN * offset))

    @cached_property
    def texels(self) -> Array:
        """(n,) bool: those that moved."""
        return np.asarray(self.moved[self.geometry.triangle])

    def traced(self, before: RayCaster) -> MovedGeometry:
        """Return what finds the rays that moved objects block; `before` casts rays in the scene as it was."""
        return MovedGeometry(self.boxes, self._alone, before)

    @cached_property
    def _alone(self) -> RayCaster:
        both = [geometry.triangles[self.moved] for geometry in (self.before, self.geometry)]
        return EmbreeCaster(np.concatenate(both), threads=1)

    @cached_property
    def near(self) -> Array:
        """(n,) bool: texels that moved, and those that what moved may stand on, touch or hood."""
        geometry = self.geometry
        return self.texels | self.boxes.near(geometry.position, AFFECTED_REACH * geometry.reach)

    @cached_property
    def widen(self) -> Array:
        """(n,) float64: how far from a texel's middle shadow rays start at most [m]."""
        geometry = self.geometry
        return np.asarray(geometry.reach + SmoothLift(geometry).heights[geometry.triangle])

    def divided(self, one: Crossings, other: Crossings) -> Array:
        """Return (n,) bool: texels that something divides or touches before or after, and that may differ."""
        split = one.crossed | one.touched | one.occluded | other.crossed | other.touched | other.occluded
        return np.asarray(self.near & ~self.texels & split)

    def renumbered(self, old: HitTable, table: HitTable, divided: Array) -> Array:
        """Return (numbers,) int32: what each hit of before is numbered now, or UNNUMBERED.

        Texels that moved, those next to them, and parts of leaves that they may cut get new numbers.

        Parameters
        ----------
        divided : (n,) bool
            See `divided`.
        """
        numbers = np.arange(old.end, dtype=np.int32)
        # A hit on a divided texel may have been answered by a neighbor.
        texels = self.texels | self.geometry.neighborhood(divided)
        numbers[: old.texel_count][texels] = UNNUMBERED
        parts = old.element_cells.renumbered(table.element_cells)
        stale = (parts < 0) | self._cells_near(table.local.elements, old.element_cells)
        numbers[old.texel_count : old.first_cell] = np.where(stale, UNNUMBERED, parts + table.texel_count)
        cells = old.texel_cells.renumbered(table.texel_cells)
        texel = old.texel_cells.texel_of(np.arange(len(cells)))
        stale = (cells < 0) | texels[texel]
        numbers[old.first_cell :] = np.where(stale, UNNUMBERED, cells + table.first_cell)
        return numbers

    def _cells_near(self, elements: ElementLookup, cells: ElementCells) -> Array:
        """Return (cells,) bool: those of elements that moved, or that a box touches."""
        hierarchy = elements.hierarchy
        offset = SIGHT_LIFT * elements.caster.surface_offset
        low, high = cells.bounds(np.arange(hierarchy.n_elements))
        touched = self.boxes.touching(low - offset, high + offset)
        touched |= self.moved[hierarchy.faces.triangle[hierarchy.face]]
        return np.asarray(touched[cells.leaf_of(np.arange(len(cells)))])
