"""Stratified points on nodes, both clusters and elements."""

from __future__ import annotations

import numpy as np

from ...numerics import Array, Stream, point_on_each_triangle, split_in_four, stratified_square
from ..hierarchy import Hierarchy
from .pair_factors import sample_clusters


def node_area(hierarchy: Hierarchy, node: Array) -> Array:
    """Return (n,) the area of nodes [m²]."""
    area = np.empty(len(node))
    single = node >= hierarchy.n_clusters
    area[single] = hierarchy.area[node[single] - hierarchy.n_clusters]
    area[~single] = hierarchy.clusters.area[node[~single]]
    return area


def node_samples(
    hierarchy: Hierarchy, node: Array, quarter: Array, keys: Array, seed: int, streams: tuple[Stream, Stream]
) -> tuple[Array, Array]:
    """Return a point in each of some quarters of nodes.

    node (n,) int.
    quarter (n, k) int: Of an element its child's place, of a cluster a fourth of its area in order.
    keys (n,) int: With the seed, what places the points.
    streams: Of places within a face, and of the face within a cluster.
    Returns points, normals (n, k, 3).
    """
    count, samples = quarter.shape
    points, normals = np.empty((count, samples, 3)), np.empty((count, samples, 3))
    within, face_stream = streams
    jitter = stratified_square(keys, samples, seed + within)
    single = np.flatnonzero(node >= hierarchy.n_clusters)
    element = node[single] - hierarchy.n_clusters
    corners = split_in_four(hierarchy.corners[element])[np.arange(len(single))[:, None], quarter[single]]
    points[single] = point_on_each_triangle(corners, jitter[single])
    normals[single] = hierarchy.faces.normal[hierarchy.face[element]][:, None]
    grouped = np.flatnonzero(node < hierarchy.n_clusters)
    along = stratified_square(keys[grouped], samples, seed + face_stream)[..., 0]
    face = sample_clusters(hierarchy, node[grouped], (quarter[grouped] + along) / 4.0)
    points[grouped] = point_on_each_triangle(hierarchy.faces.corners[face], jitter[grouped])
    normals[grouped] = hierarchy.faces.normal[face]
    return points, normals
