"""Texels that geometry divides, occludes or touches.

Such a texel shows the mean of both sides, as it should, but answers no ray with it: see
`cells.py`.

Geometry that hovers closely over a surface (a window's frame a millimeter off the wall, a door in its
frame) separates light from dark in the same way, although nothing stands on the texel, and lines of
sight along the surface pass through the gap. Short probes along the normal find the texels that are
*hooded*, in full or in part.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, fill_chunks
from ...rays import SIGHT_LIFT, RayCaster
from .states import DIVIDED, OCCLUDED, TOUCHED
from .texel_geometry import NO_TEXEL, TexelGeometry

CHUNK = 1 << 14
"""Texels tested at once; bounds the temporaries to about 60 MB."""

INSET = 0.96
"""Corners are drawn in to this part: a texel that ends at a wall is not crossed by it, …"""

OUTSET = 1.01
"""… but touched, if the wall crosses corners drawn out so far."""

HOOD = 0.25
"""What is nearer above a surface than this part of a texel's width hoods it. Light reaches about as far
into a gap as the gap is high: into a high one it fades over texels, without a hood's sharp rim."""

CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], dtype=np.float32)
"""Of a texel's unit square, in turn."""

_EDGES = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
_DIAGONALS = np.array([[0, 2], [1, 3]])
_SPOTS = np.array([[u, v] for u in (0.02, 0.5, 0.98) for v in (0.02, 0.5, 0.98)], dtype=np.float32)


@dataclass(frozen=True)
class Crossings:
    """The effect of geometry on n texels, (n,) bool each.

    cut geometry stands on them.
    touched they end at geometry; neither cut nor at a rim.
    rim a hood's rim is above them.
    occluded all of them is below a hood; neither cut nor at a rim.
    """

    geometry: TexelGeometry
    cut: Array
    touched: Array
    rim: Array
    occluded: Array

    @cached_property
    def crossed(self) -> Array:
        """Texels that are cut or at a rim: more than one light falls on them."""
        return self.cut | self.rim

    @property
    def state(self) -> Array:
        """(n,) uint8: see `TEXEL_STATES`."""
        state = np.zeros(len(self.cut), dtype=np.uint8)
        # The last one that holds counts.
        for flags, value in ((self.touched, TOUCHED), (self.occluded, OCCLUDED), (self.crossed, DIVIDED)):
            state[flags] = value
        return state

    @cached_property
    def alone(self) -> Array:
        """Texels whose light differs from their neighbors' even where they see each other."""
        return self.crossed | self.occluded

    @cached_property
    def fading(self) -> Array:
        """Occluded texels at the rim of a gap or of a chart, where light fades over less than a texel."""
        inner = np.zeros(len(self.occluded), dtype=bool)
        for numbers in self.geometry.index:
            dark, there = np.zeros(np.add(numbers.shape, 2), dtype=bool), numbers != NO_TEXEL
            dark[1:-1, 1:-1][there] = self.occluded[numbers[there]]
            around = dark[:-2] & dark[1:-1] & dark[2:]
            around = around[:, :-2] & around[:, 1:-1] & around[:, 2:]
            inner[numbers[around]] = True
        return np.asarray(self.occluded & ~inner)

    @cached_property
    def next_to_crossed(self) -> Array:
        """Texels next to a crossed one: geometry there blocks half of their view."""
        return self.geometry.neighborhood(self.crossed) & ~self.alone


def find_crossings(
    geometry: TexelGeometry,
    caster: RayCaster,
    threads: int = 0,
    before: Crossings | None = None,
    again: Array | None = None,
    progress: Progress = SILENT,
) -> Crossings:
    """Find the texels that geometry divides, touches or occludes.

    With the crossings `before` something moved, only the texels `again` (row numbers) are tested.
    """
    if before is None or again is None:
        result = Crossings(geometry, *np.zeros((4, len(geometry)), dtype=bool))
        rows = None
    else:
        were = (before.cut, before.touched, before.rim, before.occluded)
        result, rows = Crossings(geometry, *(flags.copy() for flags in were)), again

    into = (result.cut, result.touched, result.rim, result.occluded)
    find = partial(_find, geometry, caster, rows)
    fill_chunks(find, into, len(geometry) if rows is None else len(rows), CHUNK, threads, progress, at=rows)
    return result


def _find(geometry: TexelGeometry, caster: RayCaster, tested: Array | None, part: slice) -> tuple[Array, ...]:
    """Return which texels are cut, touched, at a rim and occluded: of all texels, or of those `tested`."""
    rows = np.arange(part.start, part.stop) if tested is None else tested[part]
    lift = SIGHT_LIFT * caster.surface_offset * geometry.surface_normal[rows][:, None]
    # Of the texel on the page: hits land on the part outside its triangle as well.
    square = geometry.squares(rows) + lift
    middle = square.mean(axis=1, keepdims=True)
    # All of the texel that is on its triangle: hits land all over it, though its light comes
    # from the middle.
    corners, ends = square.copy(), np.flatnonzero(~geometry.whole[rows])
    spots = np.broadcast_to(CORNERS, (len(ends), 4, 2))
    corners[ends] = geometry.sample(rows[ends], spots, 1.0) + lift[ends]
    center = geometry.position[rows][:, None] + lift
    from_center = corners - center
    cut = ~_segments_free(caster, center + INSET * from_center, _EDGES)
    doubtful = ~_segments_free(caster, middle + OUTSET * (square - middle), _DIAGONALS) & ~cut
    uncertain = np.flatnonzero(doubtful)
    cut[uncertain] = ~_segments_free(caster, center[uncertain] + INSET * from_center[uncertain], _DIAGONALS)
    spots = geometry.sample(rows, np.broadcast_to(_SPOTS, (len(rows), *_SPOTS.shape)), 1.0)
    below = below_hood(geometry, caster, rows, spots)
    hooded = below.all(axis=1)
    rim = below.any(axis=1) & ~hooded
    return cut, doubtful & ~cut & ~rim, rim, hooded & ~cut


def below_hood(geometry: TexelGeometry, caster: RayCaster, texel: Array, spots: Array) -> Array:
    """Return (n, k) whether something is close above (n, k, 3) spots on texels."""
    lift, normal = SIGHT_LIFT * caster.surface_offset, geometry.surface_normal[texel]
    square = geometry.squares(texel)
    width = np.linalg.norm(square[:, 2] - square[:, 0], axis=1) / np.sqrt(2.0)
    height = np.maximum(HOOD * width, 2.0 * lift)
    probes = np.broadcast_to(normal[:, None], spots.shape).reshape(-1, 3)
    start = (spots + lift * normal[:, None]).reshape(-1, 3)
    free = caster.unoccluded(start, probes, np.repeat(height - lift, spots.shape[1]))
    return np.asarray(~free.reshape(spots.shape[:2]))


def _segments_free(caster: RayCaster, corners: Array, segments: Array) -> Array:
    """Return (n,) whether all segments, pairs of (n, 4, 3) corners, meet nothing."""
    return np.asarray(_free(caster, corners[:, segments[:, 0]], corners[:, segments[:, 1]]).all(axis=1))


def _free(caster: RayCaster, start: Array, end: Array) -> Array:
    """Return (n, k) whether segments between (n, k, 3) points meet nothing."""
    along = (end - start).reshape(-1, 3)
    length = np.linalg.norm(along, axis=1)
    directions = along / np.maximum(length, 1e-300)[:, None]
    free = caster.unoccluded(start.reshape(-1, 3), directions, length)
    return free.reshape(start.shape[:2])
