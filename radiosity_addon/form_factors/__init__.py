"""Form factors in closed form: the share of the light leaving one shape that meets another.

Points, polygons, triangles, discs and spheres; no visibility.
"""

from __future__ import annotations

from .geometry_kernel import MIN_SHARE, kernel, ray_geometry_term, throughput, visibility_of
from .polygon import point_to_polygon
from .round_shapes import cap_cosine, point_to_ellipse
from .triangle_pairs import triangle_to_triangle, weighted_sums

__all__ = [
    "MIN_SHARE",
    "cap_cosine",
    "kernel",
    "point_to_ellipse",
    "point_to_polygon",
    "ray_geometry_term",
    "throughput",
    "triangle_to_triangle",
    "visibility_of",
    "weighted_sums",
]
