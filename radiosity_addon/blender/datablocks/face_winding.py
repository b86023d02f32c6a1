"""Which way the polygons of a mesh face: a digest of it, and selecting or flipping some of them.

A polygon's front is where its corners run counter-clockwise.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import bmesh
import bpy
import numpy as np

CUSTOM_NORMAL = "custom_normal"
"""The attribute of custom normals since Blender 4.5: two numbers relative to the normal without them, or free
vectors."""


def shape_digest(mesh: bpy.types.Mesh) -> str:
    """Return a digest of a mesh's polygons, the order of their corners, and where vertices are."""
    starts = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    found = hashlib.blake2b(starts.tobytes(), digest_size=16)
    # Attributes are read a hundred times as fast as loops and vertices.
    for name, key, width in ((".corner_vert", "value", 1), ("position", "vector", 3)):
        attribute = mesh.attributes.get(name)
        if attribute is not None:
            values = np.empty(width * len(attribute.data), dtype=np.int32 if width == 1 else np.float32)
            attribute.data.foreach_get(key, values)
            found.update(values.tobytes())
    return found.hexdigest()


def select_polygons(mesh: bpy.types.Mesh, polygons: Sequence[int]) -> None:
    """Select polygons of a mesh in Object Mode, with their edges and vertices, and nothing else of it."""
    chosen = set(polygons)
    # By the mesh itself, to set edges crashes Blender 5.0 where a script made the mesh.
    with _opened(mesh) as work:
        work.select_mode = {"FACE"}
        for face in work.faces:
            face.select = face.index in chosen
        work.select_flush_mode()


def flip_polygons(mesh: bpy.types.Mesh, polygons: Sequence[int]) -> None:
    """Have polygons of a mesh face the other way; each corner keeps its UVs and colors.

    The mesh must be in Object Mode. Custom normals of these polygons are reversed, those of others stay.
    """
    custom = mesh.attributes.get(CUSTOM_NORMAL)
    is_free = custom is not None and custom.data_type == "FLOAT_VECTOR"
    normals = None
    if mesh.has_custom_normals and not is_free:
        normals = np.empty((len(mesh.loops), 3), dtype=np.float32)
        mesh.corner_normals.foreach_get("vector", normals.reshape(-1))
    with _opened(mesh) as work:
        bmesh.ops.reverse_faces(work, faces=[work.faces[number] for number in polygons], flip_multires=True)
    if normals is not None:
        order, is_flipped = _corners(mesh, polygons)
        # All of them: they are stored relative to normals that change along with a neighbor's.
        mesh.normals_split_custom_set(np.where(is_flipped[:, None], -1.0, 1.0) * normals[order])
    elif is_free:
        _reverse_free_normals(mesh, polygons)
        mesh.update()


@contextmanager
def _opened(mesh: bpy.types.Mesh) -> Iterator[bmesh.types.BMesh]:
    """Yield a mesh for edits, which it takes over at the end."""
    work = bmesh.new()
    try:
        work.from_mesh(mesh)
        work.faces.ensure_lookup_table()
        yield work
        work.to_mesh(mesh)
    finally:
        work.free()
    mesh.update()


def _sizes(mesh: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return (p,) the first corner of each polygon, and the number of its corners."""
    start, size = (np.empty(len(mesh.polygons), dtype=np.int32) for _ in range(2))
    mesh.polygons.foreach_get("loop_start", start)
    mesh.polygons.foreach_get("loop_total", size)
    return start, size


def _corners(mesh: bpy.types.Mesh, polygons: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return (l,) the place that each corner had before polygons were flipped, and whether its polygon was.

    The first corner of each polygon stays the first.
    """
    start, size = _sizes(mesh)
    polygon = np.repeat(np.arange(len(size)), size)
    is_flipped = np.isin(polygon, polygons)
    corner = np.arange(len(polygon))
    place = corner - start[polygon]
    mirrored = start[polygon] + (size[polygon] - place) % size[polygon]
    return np.where(is_flipped, mirrored, corner), is_flipped


def _reverse_free_normals(mesh: bpy.types.Mesh, polygons: Sequence[int]) -> None:
    """Reverse normals that are vectors, of corners, of polygons, or of vertices with no other polygons."""
    attribute = mesh.attributes[CUSTOM_NORMAL]
    _, reversed_corners = _corners(mesh, polygons)
    if attribute.domain == "CORNER":
        reverse = reversed_corners
    elif attribute.domain == "FACE":
        reverse = np.isin(np.arange(len(mesh.polygons)), polygons)
    else:
        vertex = np.empty(len(mesh.loops), dtype=np.int32)
        mesh.loops.foreach_get("vertex_index", vertex)
        count = len(mesh.vertices)
        reverse = np.bincount(vertex, reversed_corners, count) > 0.5 * np.bincount(vertex, minlength=count)
    vectors = np.empty((len(attribute.data), 3), dtype=np.float32)
    attribute.data.foreach_get("vector", vectors.reshape(-1))
    vectors[reverse] *= -1.0
    attribute.data.foreach_set("vector", vectors.reshape(-1))
