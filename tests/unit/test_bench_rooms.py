"""The rooms and the furniture of the benchmarks: closed where they must be, and turned the right way."""

from __future__ import annotations

import numpy as np
import pytest

from bench.interior import furniture, shapes
from bench.rooms import POWER, SIZE, room
from radiosity_addon.lightmap.texels.rasterization import coverage_sum


@pytest.mark.parametrize("triangles", [100, 1_000, 10_000])
def test_rooms_are_closed_and_lit_by_one_power(triangles: int) -> None:
    scene, uv = room(triangles)
    assert len(scene) == pytest.approx(triangles, rel=0.25)
    assert signed_volume(scene.triangles) == pytest.approx(1.2 * 1.0 * 0.9 - np.prod(SIZE))
    assert closed(scene.triangles)
    np.testing.assert_allclose(scene.areas @ scene.emission, POWER)
    # One layout without overlaps, all seen from the front.
    edge_1, edge_2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    assert (edge_1[:, 0] * edge_2[:, 1] > edge_1[:, 1] * edge_2[:, 0]).all()
    assert coverage_sum(uv, 64).max() < 1.001


@pytest.mark.parametrize(
    "shape",
    [
        shapes.box("a", (1, 2, 3)),
        shapes.cylinder("a", 0.5, 2, 12, bottom=True),
        shapes.ball("a", 1, 16),
        shapes.cushion("a", (2, 1, 0.5), 16),
        shapes.rod("a", (0, 0, 0), (1, 2, -1), 0.1, 8),
        shapes.box("a", (1, 2, 3)).turned(40).turned(25, axis=0).at(1, 2, 3),
    ],
    ids=["box", "cylinder", "ball", "cushion", "rod", "moved"],
)
def test_solids_are_closed_and_look_outwards(shape: shapes.Shape) -> None:
    corners = triangulated(shape)
    assert closed(corners)
    assert signed_volume(corners) > 0


def test_round_things_have_their_volume() -> None:
    ball = signed_volume(triangulated(shapes.ball("a", 1, 64)))
    assert ball == pytest.approx(4 / 3 * np.pi, rel=0.01)
    cylinder = signed_volume(triangulated(shapes.cylinder("a", 0.5, 2, 96, bottom=True)))
    assert cylinder == pytest.approx(np.pi * 0.5, rel=0.002)


def test_a_wall_lacks_its_holes_and_faces_the_room() -> None:
    wall = shapes.wall_with_holes("a", 10, 3, [(1, 1, 3, 2), (5, 0.5, 6, 2)])
    corners = triangulated(wall)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (cross[:, 1] > 0).all()
    assert 0.5 * cross[:, 1].sum() == pytest.approx(30 - 2 - 1.5)


def test_every_piece_of_furniture_stands_on_the_floor() -> None:
    random = np.random.default_rng(1)
    pieces = {
        "desk": furniture.desk(),
        "chair": furniture.office_chair(12),
        "bookcase": furniture.bookcase(random),
        "plant": furniture.plant(random, 12),
        "table": furniture.round_table(24),
        "sofa": furniture.sofa(12),
        "bin": furniture.waste_bin(12),
        "door": furniture.door(),
    }
    for name, shape in pieces.items():
        assert -1e-9 <= shape.vertices[:, 2].min() < 0.13, name
        assert len(shape.faces) == len(shape.paint), name
        assert max(max(face) for face in shape.faces) < len(shape.vertices), name


def triangulated(shape: shapes.Shape) -> np.ndarray:
    """Return (t, 3, 3): the faces as fans."""
    fans = [(face[0], face[i], face[i + 1]) for face in shape.faces for i in range(1, len(face) - 1)]
    return shape.vertices[np.array(fans)]


def signed_volume(corners: np.ndarray) -> float:
    return float(np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


def closed(corners: np.ndarray) -> bool:
    """Return whether every edge is passed as often in one direction as in the other."""
    points = np.round(corners, 6) + 0.0
    _, number = np.unique(points.reshape(-1, 3), axis=0, return_inverse=True)
    number = number.reshape(-1, 3)
    edges = np.concatenate([number[:, [0, 1]], number[:, [1, 2]], number[:, [2, 0]]]).tolist()
    there = sorted(tuple(edge) for edge in edges)
    return there == sorted((b, a) for a, b in there)
