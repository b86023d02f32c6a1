"""The fallback chart grower: connected faces that face along the same axis are a chart.

Takes time in proportion to the mesh, whatever the mesh is like, where xatlas may take minutes.
Charts are more and smaller than xatlas', and stretched up to √3 before they are set to scale.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...numerics import connected_faces, double_area_vectors, numbered

Float = NDArray[np.float64]
Int = NDArray[np.int64]


def box_charts(vertices: Float, faces: Int) -> tuple[Float, Int]:
    """Cut a mesh into charts by the axis closest to each face's normal.

    vertices (v, 3).
    faces (n, 3) int64.
    Returns uv (n, 3, 2): The faces' shadows on the plane across their axis, counter-clockwise from the front.
    Returns chart (n,) int64: Faces of one axis that share vertices share a chart.
    """
    corners = vertices[faces]
    normal = double_area_vectors(corners)
    axis = np.abs(normal).argmax(axis=1)
    ahead = normal[np.arange(len(faces)), axis] > 0
    # Two other axes, in the order that keeps fronts counter-clockwise.
    first, second = (axis + 1) % 3, (axis + 2) % 3
    u = np.take_along_axis(corners, np.where(ahead, first, second)[:, None, None], axis=2)[..., 0]
    v = np.take_along_axis(corners, np.where(ahead, second, first)[:, None, None], axis=2)[..., 0]
    kind = 2 * axis + ahead
    corner = numbered((kind[:, None] * (int(faces.max(initial=0)) + 1) + faces).ravel())
    return np.stack((u, v), axis=-1), connected_faces(corner.reshape(-1, 3))
