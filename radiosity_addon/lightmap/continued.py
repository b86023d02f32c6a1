"""Texels that triangles of one plane cover together, such as those on the diagonal of a quad.

A texel belongs to one triangle and is cut by its edges. Where the next triangle goes on in the same
plane and lays its texels in the same way, nothing ends at that edge: the texel is as whole as any.
"""

from __future__ import annotations

import numpy as np

from ..solver.arrays import Array
from ..solver.visibility import RayCaster
from .crossings import LIFT, free_inside
from .rasterise import overlap_areas
from .texel_geometry import TexelGeometry

ASIDE = 0.01
"""Texels by which two triangles may lay the same texel apart from each other along their plane."""

OFF_PLANE = 0.25
"""Ray offsets by which they may lie above each other: rays from one must not start below the other."""

UNCOVERED = 1e-4
"""Share of a texel that rounding of UVs may leave uncovered."""

CHUNK = 1 << 14
"""Texels looked at at once; bounds the temporaries to about 40 MB."""

_THREE_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
_NEIGHBOURS = np.array([(y, x) for y in (-1, 0, 1) for x in (-1, 0, 1) if (y, x) != (0, 0)])


def join_continued(geometry: TexelGeometry, caster: RayCaster) -> None:
    """Make texels whole that their triangle and those that go on in its plane cover together.

    Not where something stands on them: at a wall on the edge between two triangles, a texel of one of
    them is better than one of both.
    """
    found = [_continued_on(geometry, number, caster.surface_offset) for number in range(len(geometry.texels))]
    rows = np.concatenate(found)
    lift = LIFT * caster.surface_offset * geometry.surface_normal[rows][:, None]
    geometry.make_whole(rows[free_inside(caster, geometry.squares(rows) + lift)])


def _continued_on(geometry: TexelGeometry, number: int, offset: float) -> Array:
    """Return the texels of a page that several triangles of one plane cover together.

    Looked at are the triangles of the eight texels around: one too small to have any of them counts
    as missing. `offset` is what rays leave surfaces by [m].
    """
    page, first = geometry.texels[number], geometry.first(number)
    framed = np.pad(geometry.index[number], 1, constant_values=-1)
    cut = np.flatnonzero(page.centre_inside & (page.area < 1.0))
    found = np.zeros(len(cut), dtype=bool)
    for start in range(0, len(cut), CHUNK):
        texel = cut[start : start + CHUNK]
        rows, columns = page.row[texel] + 1, page.column[texel] + 1
        around = framed[rows[:, None] + _NEIGHBOURS[:, 0], columns[:, None] + _NEIGHBOURS[:, 1]]
        own = geometry.triangle[first + texel]
        others = np.sort(np.where(around < 0, own[:, None], geometry.triangle[around]), axis=1)
        new = others != own[:, None]
        new[:, 1:] &= others[:, 1:] != others[:, :-1]
        of, place = np.nonzero(new)
        other = others[of, place]
        alike = _alike(geometry, first + texel[of], other, offset)
        of, other = of[alike], other[alike]
        covered = page.area[texel].astype(np.float64)
        row, column = page.row[texel[of]], page.column[texel[of]]
        np.add.at(covered, of, overlap_areas(geometry.uv, page.resolution, other, row, column))
        found[start : start + CHUNK] = covered >= 1.0 - UNCOVERED
    return np.asarray(first + cut[found])


def _alike(geometry: TexelGeometry, texel: Array, other: Array, offset: float) -> Array:
    """Return (p,) whether other triangles put texels where the texels' own triangles do."""
    spots = np.broadcast_to(_THREE_CORNERS, (len(texel), 3, 2))
    own = geometry.in_plane(texel, spots)
    apart = geometry.in_plane(texel, spots, other) - own
    normal = geometry.surface_normal[texel]
    above = np.einsum("pck,pk->pc", apart, normal)
    aside = np.linalg.norm(apart - above[..., None] * normal[:, None], axis=2)
    edges = np.linalg.norm(own[:, 1:] - own[:, :1], axis=2).min(axis=1)
    same_side = np.einsum("pk,pk->p", geometry.face_normals[other], normal) > 0.0
    near = (np.abs(above) <= OFF_PLANE * offset) & (aside <= ASIDE * edges[:, None])
    return np.asarray(same_side & near.all(axis=1))
