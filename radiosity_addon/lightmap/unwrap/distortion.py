"""Faces whose texels are stretched: several times as long as wide in the world, and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...base import BakeWarning
from ...numerics import double_area_vectors, signed_double_areas
from ..texels import is_collapsed

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int64]

STRETCH = 2.0
"""A texel that is more times as long as wide is stretched."""

VISIBLE = 1.0 / 16.0
"""Texels; what covers less is not looked at: it is seen in no picture, and rounding gives it its shape."""

MENTIONED = 0.05
"""Part of an object's surface that is worth a warning."""

FLAT = 0.02
"""The normals of a flat polygon lie within this distance (chord length)."""

BENT, CURVED, PACKED = "bent polygons", "a curved surface", "too little room on the page"

FIXES = {
    BENT: "triangulate or planarize its polygons, or subdivide it",
    CURVED: "give it a UV layer Lightmap with more seams and keep UVs",
    PACKED: "raise the resolution",
}


@dataclass(frozen=True)
class Stretched:
    """Faces of an object whose texels are stretched for one reason.

    faces: The number of triangles.
    share: Of the object's surface.
    """

    name: str
    page: int
    reason: str
    faces: int
    share: float


def stretched_faces(
    name: str, triangles: Float, polygon: Int, flat: Float, uv: Float32, page: tuple[int, int]
) -> list[Stretched]:
    """Return what is stretched of an object; faces that share texels have no shape, and are left out.

    triangles (n, 3, 3), polygon (n,): The object.
    flat (n, 3, 2): Its charts, before they were packed.
    uv (n, 3, 2): Where they are on the page.
    page: Its number and resolution.
    """
    texels = 0.5 * np.abs(signed_double_areas(uv.astype(np.float64))) * page[1] ** 2
    rows = np.flatnonzero((texels > VISIBLE) & ~is_collapsed(uv))
    rows = rows[elongation(triangles[rows], uv[rows].astype(np.float64)) > STRETCH]
    if not len(rows):
        return []
    cross = double_area_vectors(triangles)
    area = np.linalg.norm(cross, axis=1)
    # Which of the two steps, to the chart or to the page, stretches more?
    packed = elongation(flat[rows], uv[rows].astype(np.float64)) > elongation(triangles[rows], flat[rows])
    bent = _bent(cross, polygon)[rows]
    found = []
    for reason, of in ((PACKED, packed), (BENT, bent & ~packed), (CURVED, ~bent & ~packed)):
        if of.any():
            share = float(area[rows[of]].sum() / max(float(area.sum()), 1e-300))
            found.append(Stretched(name, page[0], reason, int(of.sum()), share))
    return found


def elongation(source: Float, target: Float) -> Float:
    """Return (n,) by which factor circles of triangles (n, 3, d) are longer than wide as (n, 3, 2) ones."""
    edge_1, edge_2 = source[:, 1] - source[:, 0], source[:, 2] - source[:, 0]
    long = np.maximum(np.linalg.norm(edge_1, axis=1), 1e-300)
    along = (edge_1 * edge_2).sum(axis=1) / long
    high = np.maximum(np.linalg.norm(edge_2 - (along / long)[:, None] * edge_1, axis=1), 1e-300)
    x = (target[:, 1] - target[:, 0]) / long[:, None]
    y = (target[:, 2] - target[:, 0] - along[:, None] * x) / high[:, None]
    xx, yy, xy = (x**2).sum(axis=1), (y**2).sum(axis=1), (x * y).sum(axis=1)
    mean, apart = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    return np.asarray(np.sqrt((mean + apart) / np.maximum(mean - apart, 1e-300)))


def _bent(cross: Float, polygon: Int) -> NDArray[np.bool_]:
    """Return (n,) which triangles belong to a polygon that is not flat."""
    count = int(polygon.max(initial=-1)) + 1
    normal = np.stack([np.bincount(polygon, cross[:, k], count) for k in range(3)], axis=-1)
    unit, axis = (
        each / np.maximum(np.linalg.norm(each, axis=1, keepdims=True), 1e-300) for each in (cross, normal)
    )
    uneven = np.zeros(count, dtype=np.bool_)
    uneven[polygon[np.linalg.norm(unit - axis[polygon], axis=1) > FLAT]] = True
    return uneven[polygon]


def stretched_warnings(found: list[Stretched]) -> list[BakeWarning]:
    """Name the objects of which a part worth mentioning is stretched."""
    return [
        BakeWarning(
            each.name,
            f"{each.share:.0%} of object '{each.name}' has texels more than twice as long as wide, "
            f"because of {each.reason}: {FIXES[each.reason]}",
        )
        for each in found
        if each.share >= MENTIONED
    ]
