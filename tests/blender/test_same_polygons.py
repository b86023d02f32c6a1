"""Whether modifiers left a mesh its polygons: corner by corner, over the same vertices."""

from __future__ import annotations

import bpy
import pytest

from radiosity_addon.blender.datablocks.mesh_arrays import same_polygons

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def _mesh(faces: list[tuple[int, ...]], vertices: list[tuple[float, ...]] = SQUARE) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new("Mesh")
    mesh.from_pydata(vertices, [], faces)
    return mesh


def test_moved_vertices_keep_the_polygons() -> None:
    moved = [(x, y, 5.0) for x, y, _ in SQUARE]
    assert same_polygons(_mesh([(0, 1, 2, 3)]), _mesh([(0, 1, 2, 3)], moved))
    assert same_polygons(_mesh([]), _mesh([], moved))


@pytest.mark.parametrize(
    ("faces", "vertices"),
    [
        ([(1, 2, 3, 0)], SQUARE),
        ([(3, 2, 1, 0)], SQUARE),
        ([(0, 1, 2)], SQUARE),
        ([(0, 1, 2, 3), (0, 1, 2)], SQUARE),
        ([(0, 1, 2), (0, 2, 3)], SQUARE),
        ([(0, 1, 2, 3)], [*SQUARE, (2, 0, 0)]),
    ],
    ids=["another start", "turned over", "a corner less", "a polygon more", "cut in two", "a vertex more"],
)
def test_others_are_told_apart(faces: list[tuple[int, ...]], vertices: list[tuple[float, ...]]) -> None:
    one = _mesh([(0, 1, 2, 3)])
    assert not same_polygons(one, _mesh(faces, vertices))
    assert not same_polygons(_mesh(faces, vertices), one)


def test_polygons_of_other_sizes_over_the_same_corners_differ() -> None:
    three, four = (0, 1, 2), (0, 1, 2, 3)
    assert not same_polygons(_mesh([three, four]), _mesh([four, three]))
