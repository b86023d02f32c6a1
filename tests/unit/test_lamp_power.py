"""Surfaces get no more of a lamp's power than it sends, and no less for where the lamp lies."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver import AreaLight, PointLight
from radiosity_addon.solver.state.lamp_power import lost_by_lamp
from radiosity_addon.solver.state.power import power_balance
from tests.rooms import box_room, gray_scene, rectangle, solid_box
from tests.unit.solved_rooms import solved


def test_few_samples_next_to_a_lamp_make_no_light() -> None:
    """Elements that may not be divided have few samples: one near a lamp spoke for all of the element."""
    floor = rectangle((-30, -30, 0), (60, 0, 0), (0, 60, 0))
    for seed in range(4):
        place = np.random.default_rng(seed).uniform(-20, 20, 2)
        lamp = PointLight((*place, 2.0), 100.0)
        power = power_balance(
            solved(gray_scene(floor, two_sided=True, lights=[lamp]), min_area=0.5, error=0.01, seed=seed)
        )
        assert power["absorbed"] + power["escaped"] < 1.02 * power["emitted"], seed


def test_both_sides_of_what_is_thinner_than_a_ray_offset_do_not_count_twice() -> None:
    """Far surfaces make offsets large; rays that start above a thin slab pass its other side."""
    slab = solid_box((-1, -1, 0), (1, 1, 0.02))
    far = rectangle((9000, 9000, 9000), (1, 0, 0), (0, 1, 0))
    lamp = PointLight((0, 0, 1.0), 100.0)
    power = power_balance(
        solved(gray_scene(np.concatenate([slab, far]), two_sided=True, lights=[lamp]), error=1e-3)
    )
    assert power["absorbed"] + power["escaped"] == pytest.approx(power["emitted"], rel=0.02)


TURN = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]


def turned_room(height: float) -> tuple[np.ndarray, AreaLight]:
    """A closed room that is turned, and a panel at a height of it, shining down; rounded as Blender does."""
    turn = TURN * np.sign(np.linalg.det(TURN))
    room = (box_room((4, 4, 2.5))[0] @ turn.T).astype(np.float32)
    middle, edge_u, edge_v = ((turn @ each).astype(np.float32) for each in np.array([
        (2.0, 2.0, height), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)]))  # fmt: skip
    return room.astype(np.float64), AreaLight(middle, edge_u, edge_v, 100.0)


@pytest.mark.parametrize("height", [2.5, 2.49])
def test_a_ceiling_does_not_shade_the_panel_that_lies_in_it(height: float) -> None:
    room, lamp = turned_room(height)
    scene = gray_scene(room, lights=[lamp])
    state = solved(scene, error=1e-2)
    black, escaped, _ = lost_by_lamp(lamp, scene, state.hierarchy, state.caster, 1)
    assert escaped == 0.0
    assert black < 0.005


def test_a_wide_lamp_shines_past_the_bulb_that_it_is_in() -> None:
    """As shadow rays have it, which look at all of the lamp's disk."""
    room, _ = box_room((3, 3, 2.5))
    bulb = solid_box((1.47, 1.47, 1.97), (1.53, 1.53, 2.03))
    lamp = PointLight((1.5, 1.5, 2.0), 100.0, radius=0.2)
    scene = gray_scene(np.concatenate([room, bulb]), two_sided=True, lights=[lamp])
    state = solved(scene, error=1e-3)
    hierarchy, links = state.hierarchy, state.light_links
    walls = hierarchy.faces.triangle[hierarchy.face[links.receiver]] < len(room)
    gain = hierarchy.area[links.receiver] * links.gain.mean(axis=1)
    # The disk's part that the bulb does not hide shines on the walls.
    assert gain[walls].sum() > 0.8
    black, escaped, error = lost_by_lamp(lamp, scene, hierarchy, state.caster, 1)
    assert black == escaped == error == 0.0
