"""The numbers of what gather rays hit, and the rows that these numbers have in a table of radiosity.

From 0: the n texels; the cells of elements, first the e elements as a whole, then sixteen smaller ones of
each; the cells of texels that geometry divides. Cells of elements answer on backs and surfaces without a
lightmap. Negative numbers are those of `solver/gather/hit_numbers.py`. Of the smaller cells only those that
rays met have rows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, TakenRows, places_in, tiles
from ...rays import SIGHT_LIFT, Hits, free_segment
from ...solver.gather import NOTHING, ElementCells, Footprints, GatheredHits, LocalPass
from ..texels import NO_TEXEL, Crossings, TexelCells, TexelGeometry, below_hood

WIDE_TEXEL = 4.0
"""Texels this many times wider than the median show less detail than leaf elements that are smaller."""

NEAR = 2.0
"""Rays of up to so many widths of an uneven texel ask its cells."""

TILE_HITS = 1 << 22
"""Stored hits that are counted or numbered at once; bounds the temporaries to about 60 MB."""


class HitTable:
    """Numbers hits of one scene, and finds what the numbers stand for.

    uneven (n,) bool: Texels over which direct light changes: short rays ask its cells.

    texel_count, first_small, first_cell, end: Where elements, their smaller cells, and cells of texels begin,
        and where all numbers end.
    """

    def __init__(
        self, local: LocalPass, geometry: TexelGeometry, crossings: Crossings, uneven: Array
    ) -> None:
        self.local, self.geometry, self.crossings = local, geometry, crossings
        elements = local.elements
        self.element_cells = ElementCells(elements.hierarchy, elements.caster, geometry.texel_size)
        self.texel_cells = TexelCells(local.elements, geometry, crossings, uneven)
        self.texel_count = len(geometry)
        self.first_small = self.texel_count + local.elements.hierarchy.n_elements
        self.first_cell = self.texel_count + len(self.element_cells)
        self.end = self.first_cell + len(self.texel_cells)
        self._in_cells, self._uneven = crossings.crossed | crossings.fading, uneven
        self._wide = geometry.texel_area > (WIDE_TEXEL * geometry.texel_size) ** 2

    def number(self, hits: Hits) -> Array:
        """Return (h,) int32 the numbers of hits: of their texel, if it can answer."""
        geometry, elements = self.geometry, self.local.elements
        texel = geometry.texel_at(hits)
        texel[self._of_others(texel, hits)] = NO_TEXEL
        found = texel.copy()
        there = texel != NO_TEXEL
        divided = np.flatnonzero(there & self._in_cells[texel])
        # What a touched texel ends at hides a corner of it: who hits that corner is not its own.
        touched = np.flatnonzero(there & self.crossings.touched[texel])
        apart = touched[~self._sees_center(texel[touched], hits.take(touched))]
        divided = np.concatenate([divided, apart])
        cell = self.texel_cells.at(texel[divided], hits.take(divided))
        found[divided] = cell + self.first_cell
        # From close by it matters which part of the texel is lit.
        near = there & self._uneven[texel]
        near[near] = hits.distance[near] ** 2 < NEAR**2 * geometry.texel_area[hits.triangle[near]]
        near[divided] = False
        close = np.flatnonzero(near)
        part = self.texel_cells.at(texel[close], hits.take(close))
        found[close] = np.where(part == NOTHING, texel[close], part + self.first_cell)
        without = divided[cell == NOTHING]
        found[without] = self._without_cell(texel[without], hits.take(without))
        large = np.flatnonzero((found >= 0) & self._wide[hits.triangle])
        finer = elements.leaf_areas(hits.take(large)) < geometry.texel_area[hits.triangle[large]]
        found[large[finer]] = NO_TEXEL
        elsewhere = found == NO_TEXEL
        hits = hits.take(elsewhere)
        cell = self.element_cells.at(elements.leaves_of(hits), hits)
        found[elsewhere] = np.where(cell == NOTHING, NOTHING, cell + self.texel_count)
        return found

    def _of_others(self, texel: Array, hits: Hits) -> Array:
        """Return the rows of hits whose texel shows another surface.

        Facets of one surface may share a pixel, and so may charts of kept UVs whose surfaces are far apart.
        A hit has to be as near to its texel as a texel is wide, and see it, over the edge between them if
        it lies behind the texel's plane.
        """
        geometry, caster = self.geometry, self.local.caster
        rows = np.flatnonzero((texel != NO_TEXEL) & (hits.triangle != geometry.triangle[texel]))
        rows = rows[~geometry.is_shared(texel[rows])]
        hits, texel = hits.take(rows), texel[rows]
        position, center = geometry.positions_of(hits), geometry.position[texel]
        normal = geometry.surface_normal[texel]
        near = geometry.holds(texel, position)
        behind = np.einsum("hk,hk->h", center - position, normal)
        lift = SIGHT_LIFT * caster.surface_offset
        bent = np.flatnonzero(near & (np.abs(behind) > lift))
        start = position[bent] + lift * geometry.face_normals[hits.triangle[bent]]
        over = start + np.maximum(behind[bent], 0.0)[:, None] * normal[bent]
        seen = free_segment(caster, start, over)
        seen &= free_segment(caster, over, center[bent] + lift * normal[bent])
        near[bent] = seen
        return np.asarray(rows[~near])

    def _without_cell(self, texel: Array, hits: Hits) -> Array:
        """Return (h,) what answers hits on texels without a cell for them: NO_TEXEL, thus an element.

        NOTHING below a hood: elements do not know of hoods, and their light would be that of the open.
        """
        position = self.geometry.positions_of(hits)[:, None]
        below = below_hood(self.geometry, self.local.caster, texel, position)[:, 0]
        return np.where(below, NOTHING, NO_TEXEL)

    def _sees_center(self, texel: Array, hits: Hits) -> Array:
        """Return (h,) whether nothing is between hits and the centers of their texels."""
        geometry, caster = self.geometry, self.local.caster
        lift = SIGHT_LIFT * caster.surface_offset * geometry.surface_normal[texel]
        return free_segment(caster, geometry.positions_of(hits) + lift, geometry.position[texel] + lift)

    def element_cell(self, number: Array) -> Array:
        """Return (p,) what cells of elements are numbered among themselves (see `ElementCells`)."""
        return np.asarray(number - self.texel_count)

    def texel_cell(self, number: Array) -> Array:
        """Return (p,) what cells of texels are numbered among themselves (see `TexelCells`)."""
        return np.asarray(number - self.first_cell)

    def elements_of(self, number: Array, below: Array) -> Array:
        """Return (k,) the leaf elements whose light numbers have in the hierarchy, or NOTHING.

        below (n,): The leaf elements below the texels, or NOTHING.
        """
        element = np.full(len(number), NOTHING, dtype=np.int64)
        texel = (number >= 0) & (number < self.texel_count)
        own = (number >= self.texel_count) & (number < self.first_cell)
        cell = number >= self.first_cell
        element[texel] = below[number[texel]]
        element[own] = self.element_cells.leaf_of(self.element_cell(number[own]))
        element[cell] = below[self.texel_cells.texel_of(self.texel_cell(number[cell]))]
        return element

    def expected(self, numbers: Array, below: Array) -> Array:
        """Return (g, k, 3) what (g, k) hits reflect by the hierarchy's light, and the sky's light [W/m²].

        below (n,): The leaf elements below the texels, or NOTHING.
        """
        elements, flat = self.local.elements, numbers.ravel()
        values = elements.reflected_of(self.elements_of(flat, below))
        values[flat < 0] = elements.beyond()[flat[flat < 0]]
        return np.asarray(values.reshape(*numbers.shape, 3))

    def reflectance(self, number: Array, of_element: bool, of_texels: Array) -> Array:
        """Return (p, 3) the reflectance of cells of elements, or of texels by that of theirs, (n, 3)."""
        if of_element:
            leaf = self.element_cells.leaf_of(self.element_cell(number))
            return self.local.elements.reflectance_of(leaf)
        return np.asarray(of_texels[self.texel_cells.texel_of(self.texel_cell(number))])

    def footprints(self, number: Array, of_element: bool) -> tuple[Footprints, Array | TakenRows]:
        """Return where cells of elements, or of texels, gather, and (p, 3) the normals of their surfaces."""
        if of_element:
            at = self.element_cells.footprints(self.element_cell(number))
            return at, at.normals
        cell = self.texel_cell(number)
        return self.texel_cells.footprints(cell), self.texel_cells.upright(cell)

    def lit_footprints(self, number: Array, of_element: bool) -> Footprints:
        """Return where cells of elements, or of texels, are lit by lamps."""
        if of_element:
            cell, irradiance = self.element_cell(number), self.local.elements.irradiance
            expected = irradiance[self.element_cells.leaf_of(cell)].mean(axis=1)
            return replace(self.element_cells.footprints(cell), expected=expected)
        return self.texel_cells.lit(self.texel_cell(number))

    def gather(
        self,
        number: Array,
        of_element: bool,
        rays: int,
        into: tuple[Array, Array | None] | None = None,
        progress: Progress = SILENT,
    ) -> GatheredHits:
        """Gather over cells of elements, or of texels; sources are numbers of hits.

        into (p, rays) int32, and (p, rays, 3) float16 or None: Takes the sources and tints, if given.
        """
        at, surface_normals = self.footprints(number, of_element)
        return self.local.gather.at(at, surface_normals, rays, self.number, into=into, progress=progress)


class TableRows:
    """Which number each row of a table of radiosity has: texels and elements their own, then small ones.

    first_small: The first row of a sub-cell or cell; all numbers below are rows.
    small (s,) int32: The numbers of those that have a row, ascending. The others answer nothing.
    """

    def __init__(self, first_small: int, small: Array) -> None:
        self._first, self._small = first_small, small

    def __len__(self) -> int:
        return self._first + len(self._small)

    def rows(self, numbers: Array) -> Array:
        """Return the rows of (k, …) numbers; negative ones stay."""
        result = numbers.copy()
        self.to_rows(result)
        return result

    def to_rows(self, numbers: Array) -> None:
        """Turn (k, …) numbers into rows where they are."""
        for tile in tiles(len(numbers), max(TILE_HITS // max(numbers[:1].size, 1), 1)):
            is_small = numbers[tile] >= self._first
            if not is_small.any():
                continue
            wanted = numbers[tile][is_small]
            place = places_in(self._small, wanted)
            there = self._small.take(place, mode="clip") == wanted
            numbers[tile][is_small] = np.where(there, self._first + place, NOTHING)

    def numbers(self, rows: Array) -> Array:
        """Return the numbers of rows of any shape; negative ones stay."""
        if len(self._small) == 0:
            return rows
        small = self._small.take(np.maximum(rows - self._first, 0), mode="clip")
        return np.asarray(np.where(rows >= self._first, small, rows))
