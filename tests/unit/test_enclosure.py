"""What arrives of the light of leaves: shared by neighbors, apart where they differ, and black backs."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.scene.opacity import ray_caster
from radiosity_addon.solver.balance import enclosure
from radiosity_addon.solver.balance.enclosure import EMISSIVE_LEAF_RAYS, LEAF_RAYS, Arrivals
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from tests.rooms import CEILING, FLOOR, box_room, gray, gray_scene, rectangle

EVERYTHING = 1e9
"""Smallest area that makes all faces neighbors."""


@pytest.fixture
def alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """Large leaves ask no more rays than small ones."""
    monkeypatch.setattr(enclosure, "SPREAD_RAYS", 0)


def measured(triangles: np.ndarray, min_area: float, shines: np.ndarray | bool = False) -> Arrivals:
    emission = gray(len(triangles), 1.0) * np.broadcast_to(shines, len(triangles))[:, None]
    scene = gray_scene(triangles, 0.5, emission)
    result = Arrivals(ray_caster(scene), min_area, seed=3)
    result.measure(Hierarchy(scene))
    return result


def open_box() -> tuple[np.ndarray, np.ndarray]:
    room, surface = box_room(n=4)
    return room[surface != CEILING], surface[surface != CEILING]


def test_in_a_closed_room_all_arrives_without_noise() -> None:
    found = measured(box_room(n=3)[0], EVERYTHING)
    assert (found.share == 1.0).all()
    assert (found.error(np.arange(len(found.share))) == 0).all()


def test_neighbors_whose_rays_disagree_ask_their_own() -> None:
    triangles, surface = open_box()
    shared, alone = measured(triangles, EVERYTHING), measured(triangles, 0.0)
    np.testing.assert_array_equal(shared.share, alone.share)
    # F from the floor of a cube to its ceiling is 0.19982.
    assert alone.share[surface == FLOOR].mean() == pytest.approx(1 - 0.19982, abs=0.02)
    assert len(np.unique(alone.share)) > 10


@pytest.mark.usefixtures("alike")
def test_too_many_share_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(enclosure, "MOST_RAYS", 0)
    assert len(np.unique(measured(open_box()[0], EVERYTHING).share)) == 1


@pytest.mark.usefixtures("alike")
def test_black_backs_take_what_does_not_escape() -> None:
    """A one-sided panel under the ceiling of a closed room: what is above sees its back."""
    room, surface = box_room((2, 2, 2), n=2)
    panel = rectangle((0.5, 0.5, 1.5), (0, 1, 0), (1, 0, 0))
    triangles = np.concatenate([room, panel])
    found = measured(triangles, 0.0)
    above = np.flatnonzero(surface == CEILING)
    assert ((found.share[above] > 0.2) & (found.share[above] < 0.95)).all()
    assert (found.rays[above] == LEAF_RAYS).all()
    assert (found.error(above) > 0).all()
    floor = np.flatnonzero(surface == FLOOR)
    assert (found.share[floor] == 1.0).all()
    assert (found.rays[floor] == LEAF_RAYS).all()


@pytest.mark.usefixtures("alike")
def test_what_shines_into_the_open_asks_more() -> None:
    triangles, surface = open_box()
    found = measured(triangles, 0.0, surface == FLOOR)
    assert (found.rays[surface == FLOOR] == EMISSIVE_LEAF_RAYS).all()
    others = (surface != FLOOR) & (found.share < 1.0)
    assert others.sum() > 10
    assert (found.rays[others] == LEAF_RAYS).all()


def test_large_leaves_ask_more() -> None:
    """The floor of an open box of ten triangles sends 1 − 0.19982 of its light to the walls."""
    room, surface = box_room()
    kept = surface != CEILING
    found = measured(room[kept], 0.0)
    assert found.rays[:10].tolist() == [8192] * 10
    assert found.share[:2].mean() == pytest.approx(1 - 0.19982, abs=0.005)
    scene = gray_scene(room[kept], 0.5)
    hierarchy = Hierarchy(scene)
    for _ in range(5):
        hierarchy.subdivide(hierarchy.leaves[:4])
    late = Arrivals(ray_caster(scene), 0.0, seed=3)
    late.measure(hierarchy)
    small = np.argmin(hierarchy.area[hierarchy.leaves])
    assert late.rays[hierarchy.leaves[small]] < 8192
