"""Cells: sixteenths of divided texels, which answer rays that hit such a texel.

A texel that a wall stands on, or that a window's frame covers in part, shows the mean of what it
holds, as it should. Light that comes back from it must not be the mean: a ray from inside a closed
box would then bring the lit floor outside. Nor can a whole neighbor answer, for the strip next to a
frame is darker than what lies a texel farther in the open. So a divided texel answers in cells,
each as those of its points that see the cell's *anchor* in a straight line just above the surface;
a hit asks the nearest cell whose anchor it sees (`element_cells.py` does the same for elements).
Through a gap the line of sight is free: what is below a hood asks what is below it, the rest what is not.
So do texels at the rim of a gap, all of them below a hood: there light fades within a few heights.

A texel shows one triangle, but its pixel may lie on others too, whose part may be below a hood or behind a
wall where the texel's is not. Hits there ask cells of the whole pixel.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from ...numerics import Array, TakenRows, fill_chunks
from ...rays import SIGHT_LIFT, Hits, RayCaster, free_segment
from ...solver.gather import NOTHING, ElementLookup, Footprints
from .occlusion import Crossings, below_hood
from .texel_geometry import TexelGeometry

ALONG = 4
"""Cells along a texel's side."""

OWN = ALONG**2
"""Cells of the part of a texel on its own triangle: the first ones. …"""

CELLS_PER_TEXEL = 2 * OWN
"""… As many of its whole pixel follow."""

ANCHOR = np.array([0.54, 0.47])
"""Of a cell. Near the middle, but off it: walls stand on round fractions of a floor."""

STARTS = 4
"""Points of a cell that its gather rays start from: each costs a ray to the anchor."""

SURFACE_COSINE = 0.9
"""Cosine between the normals of a texel's triangle and of another one that the texel lies on as well."""

CHUNK_TEXELS = 1 << 13
"""Texels divided at once; bounds the temporaries to about 20 MB."""

_FIRST = np.stack(np.divmod(np.arange(OWN), ALONG)[::-1], axis=1) / ALONG
"""(16, 2): the corner of every cell next to the texel's own first one, in the texel's unit square."""

_SPOTS = _FIRST + ANCHOR / ALONG
"""(16, 2): the anchors of cells there."""


class TexelCells:
    """The cells of some texels, numbered texel by texel.

    crossings: Those have cells that are crossed or touched, or where light fades in a gap, …
    uneven (n,) bool: … and these.
    """

    def __init__(
        self, elements: ElementLookup, geometry: TexelGeometry, crossings: Crossings, uneven: Array
    ) -> None:
        self.elements, self._geometry = elements, geometry
        self._rim = crossings.rim
        divided = crossings.crossed | crossings.fading | crossings.touched | uneven
        self.texel = np.flatnonzero(divided).astype(np.int32)
        """(d,) The divided texels."""
        self._divided = divided
        self._rank = np.cumsum(divided, dtype=np.int32) - 1
        # From the texels, as in `SpreadPoints`.
        self._own_anchors = geometry.scratch.empty((len(self.texel), OWN, 3), np.float32)
        self._below = np.zeros(len(self.texel), dtype=np.uint32)
        """(d,) A bit for each of a texel's cells: whether it is below a hood."""
        place = partial(_anchors, geometry, elements.caster, self._rim, self.texel)
        into = (self._own_anchors, self._below)
        fill_chunks(place, into, len(self.texel), CHUNK_TEXELS, elements.threads)

    def __len__(self) -> int:
        return CELLS_PER_TEXEL * len(self.texel)

    def texel_of(self, cell: Array) -> Array:
        """Return (p,) the texel that each cell is of."""
        return np.asarray(self.texel[cell // CELLS_PER_TEXEL])

    def renumbered(self, other: TexelCells) -> Array:
        """Return (cells,) int32 the numbers that these cells have among another's, or NOTHING."""
        number = np.where(other._divided[self.texel], other._rank[self.texel], NOTHING)
        cell = CELLS_PER_TEXEL * number[:, None] + np.arange(CELLS_PER_TEXEL)
        return np.where(number[:, None] == NOTHING, NOTHING, cell).ravel().astype(np.int32)

    def at(self, texel: Array, hits: Hits) -> Array:
        """Return (h,) int32: the nearest cell of its `texel` whose anchor each hit sees, or NOTHING."""
        geometry, caster = self._geometry, self.elements.caster
        found = np.full(len(texel), NOTHING, dtype=np.int32)
        normal = geometry.surface_normal[texel]
        # On the page a texel may extend beyond its triangle onto one with another normal.
        alike = np.einsum("hk,hk->h", geometry.face_normals[hits.triangle], normal) > SURFACE_COSINE
        waiting = np.flatnonzero(alike)
        position = geometry.positions_of(hits) + self._lift(texel)
        rank = self._rank[texel]
        foreign = (hits.triangle != geometry.triangle[texel]) & ~geometry.is_shared(texel)
        anchors = geometry.position[texel][:, None] + self._own_anchors[rank]
        first = np.where(foreign, OWN, 0)
        anchors[foreign] = _pixel_anchors(geometry, caster, texel[foreign])
        apart = anchors - position[:, None]
        square = np.einsum("hkx,hkx->hk", apart, apart)
        below = self._below_hood(texel, geometry.positions_of(hits)[:, None])[:, 0]
        for _ in range(OWN):
            if len(waiting) == 0:
                break
            cell = square[waiting].argmin(axis=1)
            square[waiting, cell] = np.inf
            seen = self._hooded(rank[waiting], first[waiting] + cell) == below[waiting]
            alike = np.flatnonzero(seen)
            asking = waiting[alike]
            seen[alike] = free_segment(caster, position[asking], anchors[asking, cell[alike]])
            number = CELLS_PER_TEXEL * rank[waiting] + first[waiting] + cell
            found[waiting[seen]] = number[seen]
            waiting = waiting[~seen]
        return found

    def footprints(self, cell: Array) -> Footprints:
        """Return cells as footprints: their samples see the anchor."""
        geometry, texel, anchor = self._geometry, self.texel_of(cell), self._anchor(cell)
        part = (cell % CELLS_PER_TEXEL).astype(np.uint8)
        cells = _ChosenCells(texel, part, anchor, self._hooded(cell // CELLS_PER_TEXEL, part))
        sample = partial(_sample, geometry, self.elements.caster, self._rim, cells)
        normal = TakenRows(geometry.normal, texel)
        return Footprints(anchor, normal, self._keys(cell), sample, starts=STARTS)

    def upright(self, cell: Array) -> TakenRows:
        """Return (p, 3) the normals of the triangles that cells are on."""
        return TakenRows(self._geometry.surface_normal, self.texel_of(cell))

    def lit(self, cell: Array) -> Footprints:
        """Return cells as footprints for the light of lamps: their anchors alone."""
        texel, geometry = self.texel_of(cell), self._geometry
        expected = self.elements.irradiance_at(geometry.triangle[texel], geometry.barycentric[texel])
        normal = TakenRows(geometry.normal, texel)
        return Footprints(self._anchor(cell), normal, self._keys(cell), expected=expected)

    def _hooded(self, rank: Array, part: Array) -> Array:
        """Return (p,) bool: whether parts of the divided texels of these ranks are below a hood."""
        return np.asarray(self._below[rank] >> part.astype(np.uint32) & 1 == 1)

    def _anchor(self, cell: Array) -> Array:
        """Return (p, 3) the anchors of cells, not lifted."""
        texel = self.texel_of(cell)
        anchor = self._geometry.position[texel] + self._own_anchors[cell // CELLS_PER_TEXEL, cell % OWN]
        others = np.flatnonzero(cell % CELLS_PER_TEXEL >= OWN)
        spots = _pixel_anchors(self._geometry, self.elements.caster, texel[others])
        anchor[others] = spots[np.arange(len(others)), cell[others] % OWN]
        return np.asarray(anchor - self._lift(texel))

    def _keys(self, cell: Array) -> Array:
        """Return (p,) int64 sampling keys of cells, which do not depend on other divided texels."""
        texel = self.texel_of(cell).astype(np.int64)
        return np.asarray(len(self._geometry) + CELLS_PER_TEXEL * texel + cell % CELLS_PER_TEXEL)

    def _below_hood(self, texel: Array, points: Array) -> Array:
        return _below_rim(self._geometry, self.elements.caster, self._rim, texel, points)

    def _lift(self, texel: Array) -> Array:
        return _lifted(self._geometry, self.elements.caster, texel)


class _ChosenCells(NamedTuple):
    """Cells of texels.

    part (p,) uint8: Which of the texel's cells it is.
    anchor (p, 3)
    below (p,) bool: Whether it is below a hood.
    """

    texel: Array
    part: Array
    anchor: Array
    below: Array


def _sample(
    geometry: TexelGeometry, caster: RayCaster, rim: Array, cells: _ChosenCells, rows: Array, u: Array
) -> Array:
    """Return (r, k, 3) points of cells that see the anchor, or the anchor."""
    texel, part, anchor, below = (column[rows] for column in cells)
    spots, own_part = _FIRST[part % OWN][:, None] + u / ALONG, part < OWN
    points = np.empty((*spots.shape[:2], 3))
    points[own_part] = geometry.sample(texel[own_part], spots[own_part], 1.0)
    points[~own_part] = geometry.in_plane(texel[~own_part], spots[~own_part])
    back = np.broadcast_to(anchor[:, None], points.shape)
    above = _lifted(geometry, caster, texel)[:, None]
    seen = free_segment(caster, (points + above).reshape(-1, 3), (back + above).reshape(-1, 3))
    # Points behind a wall, or beyond an occluder's rim, do not belong to this cell.
    own = seen.reshape(points.shape[:2])
    own &= _below_rim(geometry, caster, rim, texel, points) == below[:, None]
    return np.asarray(np.where(own[..., None], points, back))


def _anchors(
    geometry: TexelGeometry, caster: RayCaster, rim: Array, texel: Array, rows: slice
) -> tuple[Array, Array]:
    """Return (r, 16, 3) from texels to their cells' lifted anchors, and (r,) uint32 which are hooded."""
    texel = texel[rows]
    spots = np.broadcast_to(_SPOTS, (len(texel), OWN, 2))
    spread = geometry.sample(texel, spots, 1.0)
    both = np.concatenate([spread, geometry.in_plane(texel, spots)], axis=1)
    anchor = spread + _lifted(geometry, caster, texel)[:, None]
    below = np.packbits(_below_rim(geometry, caster, rim, texel, both), axis=1, bitorder="little")
    return anchor - geometry.position[texel][:, None], below.view("<u4")[:, 0]


def _pixel_anchors(geometry: TexelGeometry, caster: RayCaster, texel: Array) -> Array:
    """Return (r, 16, 3) the lifted anchors of the cells of whole pixels."""
    spots = np.broadcast_to(_SPOTS, (len(texel), OWN, 2))
    return np.asarray(geometry.in_plane(texel, spots) + _lifted(geometry, caster, texel)[:, None])


def _below_rim(geometry: TexelGeometry, caster: RayCaster, rim: Array, texel: Array, points: Array) -> Array:
    """Return (n, k) whether (n, k, 3) points of texels at a rim are below the hood; False elsewhere."""
    below = np.zeros(points.shape[:2], dtype=bool)
    at_rim = np.flatnonzero(rim[texel])
    below[at_rim] = below_hood(geometry, caster, texel[at_rim], points[at_rim])
    return below


def _lifted(geometry: TexelGeometry, caster: RayCaster, texel: Array) -> Array:
    """Return (n, 3) how far lines of sight start above texels [m]."""
    return np.asarray(SIGHT_LIFT * caster.surface_offset * geometry.surface_normal[texel])
