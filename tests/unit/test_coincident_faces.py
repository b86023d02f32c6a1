"""Sheets that lie in one another: linked as clusters, against a single sheet; and how they are reported."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.bake_warnings import coincident_counts, of_coincident
from radiosity_addon.scene.coincident_faces import coincident_triangles
from radiosity_addon.solver.methods.hierarchical import HierarchicalState
from radiosity_addon.solver.state.power import power_balance
from tests.rooms import CEILING, box_room, gray, gray_scene, rectangle, solid_box
from tests.unit.solved_rooms import solved
from tests.unit.texel_scenes import bake_scene

REFLECTANCE = 0.6
ROOM = 6 * 2 * 4**2


def with_sheets(kind: str) -> HierarchicalState:
    """A closed room under a shining ceiling with a sheet of 128 triangles in the air, once or twice."""
    room, surface = box_room((2, 2, 2), n=4)
    sheet = rectangle((0.4, 0.4, 0.8), (1.2, 0, 0), (0, 1.2, 0), 8)
    sheets = {"single": [sheet], "twice": [sheet, sheet], "back to back": [sheet, sheet[:, ::-1]]}[kind]
    triangles = np.concatenate([room, *sheets])
    emission = gray(len(triangles), 0.0)
    emission[:ROOM][surface == CEILING] = 1.0
    two_sided = np.arange(len(triangles)) >= ROOM if kind != "back to back" else None
    scene = gray_scene(triangles, REFLECTANCE, emission, two_sided=two_sided)
    state = solved(scene, error=1e-3)
    assert len(state.cluster_links) > 1000
    return state


@pytest.fixture(scope="module")
def single() -> HierarchicalState:
    return with_sheets("single")


def light(state: HierarchicalState) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the irradiance of the room's faces, and of the sheets' that look up and down."""
    faces = state.hierarchy.faces
    irradiance = state.irradiance[: len(faces), 0]
    on_sheet = np.abs(faces.center[:, 2] - 0.8) < 1e-6
    up = faces.normal[:, 2] > 0.5
    return irradiance[:ROOM], irradiance[on_sheet & up], irradiance[on_sheet & ~up]


def power_ratio(state: HierarchicalState) -> float:
    faces = state.hierarchy.faces
    absorbed = (1 - REFLECTANCE) * float(faces.area @ state.irradiance[: len(faces), 0])
    return absorbed / float(faces.area @ faces.emission[:, 0])


def test_sheets_back_to_back_are_one_two_sided_sheet(single: HierarchicalState) -> None:
    state = with_sheets("back to back")
    assert power_ratio(state) == pytest.approx(1.0, abs=1e-4)
    # No ray ends on the black back that lies in the other sheet.
    power = power_balance(state)
    assert power["absorbed"] == pytest.approx(power["emitted"], rel=1e-4)
    (walls, up, down), (walls_alone, up_alone, down_alone) = light(state), light(single)
    assert len(up) == len(up_alone) == len(down) == len(down_alone) == 128
    assert walls.mean() == pytest.approx(walls_alone.mean(), rel=0.002)
    assert up.mean() == pytest.approx(up_alone.mean(), rel=0.02)
    # No light passes: what is below has a fifth of what is above.
    assert down.mean() == pytest.approx(down_alone.mean(), rel=0.05)
    assert down.mean() < 0.25 * up.mean()


def test_sheets_that_face_the_same_way_make_no_light(single: HierarchicalState) -> None:
    """One of them counts: the room is as bright as with a single sheet."""
    state = with_sheets("twice")
    power = power_balance(state)
    assert power["absorbed"] == pytest.approx(power["emitted"], rel=1e-4)
    assert state.residual < state.settings.tolerance
    (walls, up, down), (walls_alone, up_alone, down_alone) = light(state), light(single)
    assert len(up) == len(down) == 256
    assert walls.mean() == pytest.approx(walls_alone.mean(), rel=2e-3)
    assert up.mean() == pytest.approx(up_alone.mean(), rel=0.02)
    assert down.mean() == pytest.approx(down_alone.mean(), rel=0.05)


def test_what_cycles_bakes_black_is_reported_but_not_what_rests_on_it() -> None:
    """Twice the same wall, a wall of two sheets, a poster in a wall's plane; not a crate on the floor."""
    floor = rectangle((0, 0, 0), (4, 0, 0), (0, 4, 0))
    wall = rectangle((0, 4, 0), (4, 0, 0), (0, 0, 3))
    sheet = rectangle((2, 1, 0.5), (0, 2, 0), (0, 0, 1))
    parts = {
        "Floor": floor,
        "Crate": solid_box((0.5, 0.5, 0), (1, 1, 0.5)),
        "Wall": wall,
        "Wall Again": wall,
        "Sheets": np.concatenate([sheet, sheet[:, ::-1]]),
        "Alone": rectangle((0, 0, 1), (0, 1, 0), (0, 0, 1)),
    }
    scene = gray_scene(np.concatenate(list(parts.values())), two_sided=True)
    objects = bake_scene(scene, *((name, len(part)) for name, part in parts.items())).objects
    counts = coincident_counts(objects, scene)
    assert counts == {"Wall": 2, "Wall Again": 2, "Sheets": 4}
    (warning,) = of_coincident(counts)
    assert warning.name == "Sheets"
    for listed in ("4 of 'Sheets'", "2 of 'Wall'", "2 of 'Wall Again'"):
        assert listed in warning.message
    assert not list(of_coincident({}))


def test_of_faces_one_closely_above_the_other_the_lower_one_is_reported() -> None:
    above = rectangle((0, 0, 1.0 + 1e-6), (1, 0, 0), (0, 1, 0))
    below = rectangle((0, 0, 1.0), (1, 0, 0), (0, 1, 0))
    scene = gray_scene(np.concatenate([above, below]), two_sided=True)
    assert coincident_triangles(scene).tolist() == [False, False, True, True]


@pytest.mark.parametrize(
    ("height", "turned", "found"),
    [
        (0.0, False, [True, True]),
        (0.6e-6, False, [True, True]),
        (0.7e-6, False, [True, False]),
        (-0.7e-6, False, [False, True]),
        (1.2e-6, False, [True, False]),
        (1.3e-6, False, [False, False]),
        (0.0, True, [True, True]),
        (0.6e-6, True, [False, False]),
        (1.2e-6, True, [False, False]),
    ],
)
def test_which_faces_coincide_as_the_guide_says(height: float, turned: bool, found: list[bool]) -> None:
    """Below 1.25 µm the one behind, below half of it both, and in one place those that face opposite ways."""
    lower, upper = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), rectangle((0, 0, height), (1, 0, 0), (0, 1, 0))
    triangles = np.concatenate([lower, upper[:, ::-1] if turned else upper])
    expected = np.repeat(found, 2)
    np.testing.assert_array_equal(coincident_triangles(gray_scene(triangles, two_sided=True)), expected)
