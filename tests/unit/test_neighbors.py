"""Which leaves are side by side: within a face, across coplanar faces, never across creases or walls."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver.hierarchy.adjacency import neighbors
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from tests.rooms import box_room, gray_scene, rectangle


def prepare(triangles: np.ndarray, two_sided: bool = False) -> tuple[Hierarchy, EmbreeCaster]:
    scene = gray_scene(triangles, two_sided=two_sided)
    return Hierarchy(scene), EmbreeCaster(scene.triangles)


def pairs_of(triangles: np.ndarray, levels: int = 0, two_sided: bool = False) -> set[tuple[int, int]]:
    hierarchy, caster = prepare(triangles, two_sided)
    for _ in range(levels):
        hierarchy.subdivide(hierarchy.leaves)
    return {(int(a), int(b)) for a, b in neighbors(hierarchy, caster)}


@pytest.mark.parametrize("levels", [0, 1, 2, 3])
def test_a_square_of_even_triangles_has_every_inner_edge(levels: int) -> None:
    """n triangles have 3n sides, of which the border takes 4·2^levels; the others are shared by two."""
    square = rectangle((0, 0, 0), (2, 0, 0), (0, 1, 0))
    pairs = pairs_of(square, levels)
    assert len(pairs) == (3 * 2 * 4**levels - 4 * 2**levels) // 2


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_a_grid_of_faces_is_one_surface_however_it_lies(turn: float) -> None:
    grid = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), n=4)
    rotation = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    pairs = pairs_of(grid @ rotation.T + [30.0, -20.0, 5.0])
    assert len(pairs) == (3 * 32 - 16) // 2


def test_neighbors_share_an_edge() -> None:
    hierarchy, caster = prepare(rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)))
    hierarchy.subdivide(hierarchy.leaves)
    for one, other in neighbors(hierarchy, caster):
        corners = [{tuple(c) for c in hierarchy.corners[e].round(9)} for e in (one, other)]
        assert len(corners[0] & corners[1]) == 2


def test_levels_meet() -> None:
    """A coarse leaf is neighbor to the finer ones along its edge."""
    hierarchy, caster = prepare(rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)))
    hierarchy.subdivide(np.array([0]))
    pairs = neighbors(hierarchy, caster)
    beside = {int(a + b - 1) for a, b in pairs if 1 in (a, b)}
    # The two corner children on the diagonal, and the one that touches the middle of the edge.
    fine = {int(e) for e in np.arange(2, 6) if (hierarchy.corners[e].round(9) @ [1, -1, 0] == 0).sum() == 2}
    assert len(fine) == 2
    assert fine <= beside
    assert beside <= {2, 3, 4, 5}


def test_creases_and_sides_are_apart() -> None:
    """Each wall of a cube has its two triangles; the two sides of a sheet have nothing in common."""
    assert len(pairs_of(box_room()[0])) == 6
    sheet = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    assert pairs_of(sheet, two_sided=True) == {(0, 1), (2, 3)}


def test_a_wall_on_the_edge_keeps_them_apart() -> None:
    """The floors of two rooms are no neighbors though they are coplanar and touch."""
    floors = np.concatenate([rectangle((x, 0, 0), (1, 0, 0), (0, 1, 0)) for x in (0, 1)])
    wall = rectangle((1, 0, 0), (0, 1, 0), (0, 0, 1))
    assert len(pairs_of(floors)) == 3
    assert len(pairs_of(np.concatenate([floors, wall]))) == 2 + 1  # the wall's own two


def test_the_backs_of_triangles_find_each_other() -> None:
    """A back's corners run the other way round than its triangle's."""
    square = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    hierarchy, caster = prepare(square, two_sided=True)
    for _ in range(2):
        hierarchy.subdivide(hierarchy.leaves)
    pairs = neighbors(hierarchy, caster)
    front = hierarchy.faces.front[hierarchy.face[pairs]]
    assert (front[:, 0] == front[:, 1]).all()
    places = hierarchy.corners[pairs].mean(axis=2).round(9)
    seen = [{frozenset(map(tuple, pair)) for pair in places[side]} for side in (front[:, 0], ~front[:, 0])]
    assert seen[0] == seen[1]
    assert len(seen[0]) == (3 * 32 - 16) // 2
