"""Form factors, one function per formula: the fraction of light leaving a receiver that meets a source.

| function | from | to | how |
|---|---|---|---|
| `point_to_polygon` | points | polygons | Lambert's outline sum, cut at the horizon |
| `point_to_ellipse` | points | one ellipse | the outline integral on the curve |
| `cap_cosine` | points | round caps | closed form (discs that face the point, spheres, the sun) |
| `triangle_to_triangle` | triangles | triangles | cubature when far, double outline integral when near |
| `disk_factor` | points | small patches | the approximation for far pairs |

All are unoccluded; visibility is kept apart. A receiver sees the front of a source only.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .polygon import point_to_polygon
from .round_shapes import cap_cosine, point_to_ellipse
from .triangle_pairs import triangle_to_triangle

__all__ = ["cap_cosine", "disk_factor", "point_to_ellipse", "point_to_polygon", "triangle_to_triangle"]

FloatArray = npt.NDArray[np.floating[Any]]


def disk_factor(
    points: FloatArray,
    normals: FloatArray,
    centers: FloatArray,
    source_normals: FloatArray,
    areas: FloatArray,
) -> FloatArray:
    """Approximate the factor from points to far sources as if each were a disk facing halfway.

    cosθ_r cosθ_s A / (π d² + A): right far away, bounded by 1 near by (Wallace et al. 1989),
    0 where either faces away. The relative error is about (source radius / distance)², so
    well below 1 % beyond ten radii. Works in the precision of its arguments.

    points, normals (n, 3): Receiver points and their unit normals.
    centers, source_normals (n, 3): Centroids and unit normals of the sources.
    areas (n,): Areas of the sources.
    Returns factors (n,) float in [0, 1), of the arguments' type.
    """
    x, y, z = (centers[:, axis] - points[:, axis] for axis in range(3))
    square = x * x + y * y + z * z
    cosine_r = x * normals[:, 0] + y * normals[:, 1] + z * normals[:, 2]
    cosine_s = x * source_normals[:, 0] + y * source_normals[:, 1] + z * source_normals[:, 2]
    # The two cosines' lengths go into one division by d².
    weight = np.maximum(cosine_r, 0) * np.maximum(-cosine_s, 0) * areas
    divisor = square * (np.pi * square + areas)
    return weight / np.where(divisor > 0, divisor, 1)
