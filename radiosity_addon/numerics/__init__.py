"""Arrays: threads, memory with a limit, sampling, triangles and polygons, quantities of light.

Knows neither scenes nor lamps.
"""

from __future__ import annotations

from .array_file import ArrayFileError, TooLargeError, read_arrays, read_digest, write_arrays
from .arrays import Array
from .bilinear import texels_around
from .blas import one_blas_thread
from .curve import along_curve
from .discrete import pick_in_rows, pick_in_runs, running_sums
from .heap import give_back
from .meshes import connected_components, connected_faces, numbered, weld
from .nearest_triangles import TriangleTree, closest_weights
from .parallel import Executor, fill_chunks, map_chunks, run_by, thread_count
from .polygons import areas, clip_half_plane, edge_distances
from .radiometry import (
    HEMISPHERE,
    MAX_REFLECTANCE,
    brdf_of_reflectance,
    cone_projected_solid_angle,
    cone_solid_angle,
    flux_of_radiance,
    intensity_of_flux,
    irradiance_from_point,
    irradiance_under_sky,
    luminous,
    most_reflectance,
    radiance_of_disc,
    radiance_of_flux,
    radiance_of_radiosity,
    radiosity_of_radiance,
    reflected_radiance,
    sphere_area,
)
from .ragged import run_chunks, run_numbers, run_starts
from .sampling import (
    concentric_disk,
    cosine_hemisphere,
    directions_to_triangles,
    hash_keys,
    orthonormal_basis,
    point_on_each_triangle,
    points_on_triangles,
    stratified_square,
    to_world,
    uniform_cone,
)
from .scratch import TILE, Rows, Scratch, folder, marked, row_numbers, tiles, trim
from .short_rows import across
from .sorted_places import places_in
from .streams import LAMP_STEP, LIGHT_STEP, SHADOW_STEP, Stream
from .taken_rows import TakenRows
from .triangles import (
    WHOLE_TRIANGLE,
    double_area_vectors,
    plane_weights_at,
    points_at,
    signed_double_areas,
    split_in_four,
    split_in_sixteen,
    triangle_areas,
    weights_at,
)

__all__ = [
    "HEMISPHERE",
    "LAMP_STEP",
    "LIGHT_STEP",
    "MAX_REFLECTANCE",
    "SHADOW_STEP",
    "TILE",
    "WHOLE_TRIANGLE",
    "Array",
    "ArrayFileError",
    "Executor",
    "Rows",
    "Scratch",
    "Stream",
    "TakenRows",
    "TooLargeError",
    "TriangleTree",
    "across",
    "along_curve",
    "areas",
    "brdf_of_reflectance",
    "clip_half_plane",
    "closest_weights",
    "concentric_disk",
    "cone_projected_solid_angle",
    "cone_solid_angle",
    "connected_components",
    "connected_faces",
    "cosine_hemisphere",
    "directions_to_triangles",
    "double_area_vectors",
    "edge_distances",
    "fill_chunks",
    "flux_of_radiance",
    "folder",
    "give_back",
    "hash_keys",
    "intensity_of_flux",
    "irradiance_from_point",
    "irradiance_under_sky",
    "luminous",
    "map_chunks",
    "marked",
    "most_reflectance",
    "numbered",
    "one_blas_thread",
    "orthonormal_basis",
    "pick_in_rows",
    "pick_in_runs",
    "places_in",
    "plane_weights_at",
    "point_on_each_triangle",
    "points_at",
    "points_on_triangles",
    "radiance_of_disc",
    "radiance_of_flux",
    "radiance_of_radiosity",
    "radiosity_of_radiance",
    "read_arrays",
    "read_digest",
    "reflected_radiance",
    "row_numbers",
    "run_by",
    "run_chunks",
    "run_numbers",
    "run_starts",
    "running_sums",
    "signed_double_areas",
    "sphere_area",
    "split_in_four",
    "split_in_sixteen",
    "stratified_square",
    "texels_around",
    "thread_count",
    "tiles",
    "to_world",
    "triangle_areas",
    "trim",
    "uniform_cone",
    "weights_at",
    "weld",
    "write_arrays",
]
