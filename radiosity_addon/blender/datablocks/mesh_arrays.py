"""Blender meshes as arrays: triangles, their corners and what they belong to."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import bpy
import numpy as np

from ...numerics import double_area_vectors
from ...scene import LIGHTMAP_UV_LAYER

_INFINITE = 1e18
"""Positions beyond this are infinite [m]: Blender stores an infinity it is given as the largest float,
and squares of lengths above this overflow single precision."""


@dataclass(frozen=True)
class MeshArrays:
    """A mesh, triangulated, in its own space.

    corners (t, 3, 3): Positions of the triangles' corners.
    normals (t, 3, 3): Unit shading normals there, as Cycles has them (see `_flat`); 0 for a flat triangle
        without area.
    loops (t, 3) int32: The mesh corners (loops) they are.
    polygon (t,) int32: The polygon each triangle is part of.
    material (t,) int32: The slot of each triangle's polygon.
    lightmap_uv (t, 3, 2) float32: The UVs of the layer `Lightmap`, where there is one.
    winding: Digest of the order in which corners go around polygons.
    """

    corners: np.ndarray
    normals: np.ndarray
    loops: np.ndarray
    polygon: np.ndarray
    material: np.ndarray
    lightmap_uv: np.ndarray | None
    uv_layers: int
    winding: str = ""

    def __len__(self) -> int:
        return len(self.corners)


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Raw data of a mesh, copied so that it can be processed when the mesh may be gone.

    positions (v, 3) float32.
    vertex (l,) int32: Of each loop.
    loops (t, 3) int32.
    polygon (t,) int32.
    material (p,) int32.
    normals (l, 3) float32.
    smooth (p,) bool.
    by_corner: Normals of corners count for flat polygons too; see `_flat`.
    lightmap_uv (l, 2) float32.
    """

    positions: np.ndarray
    vertex: np.ndarray
    loops: np.ndarray
    polygon: np.ndarray
    material: np.ndarray
    normals: np.ndarray
    smooth: np.ndarray
    by_corner: bool
    lightmap_uv: np.ndarray | None
    uv_layers: int


def read_mesh(mesh: bpy.types.Mesh) -> MeshArrays | None:
    """Return a mesh's triangles; None if a vertex is NaN or infinite.

    Loose vertices and edges are left out: they neither reflect nor block.
    """
    return mesh_arrays(copy_mesh_data(mesh))


def copy_mesh_data(mesh: bpy.types.Mesh) -> RawMesh:
    """Copy the data needed from a mesh, quickly."""
    mesh.calc_loop_triangles()
    triangles, corners, polygons = len(mesh.loop_triangles), len(mesh.loops), len(mesh.polygons)
    layer = mesh.uv_layers.get(LIGHTMAP_UV_LAYER)
    return RawMesh(
        positions=_read(mesh.vertices, "co", (len(mesh.vertices), 3), np.float32),
        vertex=_read(mesh.loops, "vertex_index", (corners,), np.int32),
        loops=_read(mesh.loop_triangles, "loops", (triangles, 3), np.int32),
        polygon=_read(mesh.loop_triangles, "polygon_index", (triangles,), np.int32),
        material=_read(mesh.polygons, "material_index", (polygons,), np.int32),
        normals=_read(mesh.corner_normals, "vector", (corners, 3), np.float32),
        smooth=_read(mesh.polygons, "use_smooth", (polygons,), np.bool_),
        by_corner=mesh.normals_domain == "CORNER" and (bpy.app.version >= (5, 2) or mesh.has_custom_normals),
        lightmap_uv=None if layer is None else _read(layer.uv, "vector", (corners, 2), np.float32),
        uv_layers=len(mesh.uv_layers),
    )


def mesh_arrays(raw: RawMesh) -> MeshArrays | None:
    """Return the triangles of a mesh that was copied; None if a vertex is NaN or infinite."""
    if not all_finite(raw.positions):
        return None
    loops, polygon = raw.loops, raw.polygon
    corners = raw.positions[raw.vertex[loops]].astype(np.float64)
    normals = raw.normals[loops].astype(np.float64)
    flat = _flat(raw)[polygon]
    normals[flat] = _unit_normals(np.zeros_like(normals[flat]), corners[flat])
    uv = None if raw.lightmap_uv is None else raw.lightmap_uv[loops]
    winding = hashlib.blake2b(raw.vertex.tobytes(), digest_size=16).hexdigest()
    return MeshArrays(corners, normals, loops, polygon, raw.material[polygon], uv, raw.uv_layers, winding)


def _flat(raw: RawMesh) -> np.ndarray:
    """Return (polygons,) which ones Cycles shades by their triangles' own normals, not the polygon's.

    The two differ where a polygon is not planar. Measured in 4.2, 5.0 and 5.2: those shaded flat; sharp
    edges all around do not make one flat, and custom normals go before. 5.2 takes the normals of
    corners for all polygons of a mesh some of which are smooth.
    """
    return ~raw.smooth & (not raw.by_corner)


def no_triangles() -> MeshArrays:
    """Return a mesh without triangles."""
    vectors, numbers = np.zeros((0, 3, 3)), np.zeros(0, dtype=np.int32)
    return MeshArrays(vectors, vectors, np.zeros((0, 3), dtype=np.int32), numbers, numbers, None, 0)


def all_finite(values: np.ndarray) -> bool:
    """Return whether positions of any shape are finite."""
    return bool((np.abs(values) < _INFINITE).all())


def not_finite_message(name: str) -> str:
    """Return the error message for an object with invalid coordinates."""
    return f"object '{name}' has NaN or infinite coordinates; fix its mesh or transform"


def same_polygons(first: bpy.types.Mesh, second: bpy.types.Mesh) -> bool:
    """Return whether two meshes have the same polygons over the same vertices, corner by corner."""
    sizes = [(len(mesh.vertices), len(mesh.polygons), len(mesh.loops)) for mesh in (first, second)]
    if sizes[0] != sizes[1]:
        return False
    for collection, attribute in (("polygons", "loop_start"), ("loops", "vertex_index")):
        rows = [getattr(mesh, collection) for mesh in (first, second)]
        values = [_read(row, attribute, (len(row),), np.int32) for row in rows]
        if not np.array_equal(values[0], values[1]):
            return False
    return True


def world_from_object(mesh: MeshArrays, matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
    """Carry a mesh's triangles into world space.

    A mirroring matrix turns counter-clockwise triangles clockwise; Blender swaps them
    back, so that the side its normals show stays the front.

    matrix (4, 4).
    Returns corners (t, 3, 3).
    Returns normals (t, 3, 3), unit: In the corners' order. A normal that vanishes becomes the face's, or 0.
    Returns mirrored: Whether the order of the corners was reversed: index what belongs to them with [:,
        ::-1].
    """
    linear = matrix[:3, :3]
    corners = mesh.corners @ linear.T + matrix[:3, 3]
    mirrored = bool(np.linalg.det(linear) < 0)
    normals = mesh.normals @ normal_matrix(linear).T
    if mirrored:
        corners, normals = corners[:, ::-1], normals[:, ::-1]
    return corners, _unit_normals(normals, corners), mirrored


def normal_matrix(linear: np.ndarray) -> np.ndarray:
    """Return the matrix that transforms normals (not their length) as `linear` (3, 3) transforms positions.

    The cofactor matrix is det · inverse-transpose, and exists for flattening ones too.
    """
    cofactors = np.cross(np.roll(linear, -1, axis=0), np.roll(linear, -2, axis=0))
    return np.asarray(-cofactors if np.linalg.det(linear) < 0 else cofactors)


def degenerate(corners: np.ndarray) -> np.ndarray:
    """Return (t,) which triangles (t, 3, 3) have no area, within single precision."""
    edges = corners - np.roll(corners, 1, axis=1)
    longest = np.einsum("tci,tci->tc", edges, edges).max(axis=1, initial=0.0)
    double_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return double_area <= 1e-7 * longest


def _unit_normals(normals: np.ndarray, corners: np.ndarray) -> np.ndarray:
    faces = double_area_vectors(corners)[:, None, :]
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    vanished = ~(length > 0)
    normals = np.where(vanished, faces, normals)
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    return normals / np.where(length > 0, length, 1.0)


def _read(
    collection: bpy.types.bpy_prop_collection, attribute: str, shape: tuple[int, ...], kind: type
) -> np.ndarray:
    values: np.ndarray = np.empty(shape, dtype=kind)
    collection.foreach_get(attribute, values.reshape(-1))
    return values
