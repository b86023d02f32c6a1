"""Links kept to be looked at: they bring what the solution says arrives."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver import PointLight, Scene, SolverSettings, SunLight
from radiosity_addon.solver.methods import solve_by_method
from radiosity_addon.solver.state.link_record import leaves_on, nearest_leaf, record_links
from tests.rooms import box_room, gray_scene, rectangle
from tests.unit.solved_rooms import corridor, furnished, solved

LAMP = PointLight((1.0, 1.2, 1.5), 20.0, radius=0.05)


def lamp_room() -> Scene:
    triangles, _ = box_room((3, 2, 2))
    return gray_scene(triangles, lights=[LAMP])


@pytest.mark.parametrize("scene", [furnished, corridor, lamp_room])
def test_the_links_that_reach_a_leaf_bring_its_irradiance(scene) -> None:  # type: ignore[no-untyped-def]
    """But for how coarse links are shared out over quarters: on the mean over the leaves they agree."""
    state = solved(scene(), error=1e-2)
    record = record_links(state)
    leaves = np.flatnonzero(record.leaf)[:: max(int(record.leaf.sum()) // 150, 1)]
    brought = np.array([record.reaching(np.array([leaf]))[2].sum() for leaf in leaves])
    arrives = state.irradiance[leaves].mean(axis=1)
    area = state.hierarchy.area[leaves]
    assert (area @ brought) / (area @ arrives) == pytest.approx(1.0, abs=0.05)
    assert np.corrcoef(brought, arrives)[0, 1] > 0.9


def test_links_from_a_lamp_end_at_it() -> None:
    record = record_links(solved(lamp_room(), error=3e-3))
    start, end, arriving = record.reaching(leaves_on(record, np.array([0])))
    at_lamp = np.abs(end - np.float32(LAMP.position)).max(axis=1) < 1e-6
    assert at_lamp.any()
    # Triangle 0 is on the floor: its links start there, and the lamp's bring what its closed form says.
    np.testing.assert_allclose(start[at_lamp][:, 2], 0.0, atol=1e-6)
    place = start[at_lamp].astype(float)
    expected = LAMP.unit_irradiance(place, np.tile([0.0, 0.0, 1.0], (len(place), 1))) * 20.0
    np.testing.assert_allclose(np.median(arriving[at_lamp] / expected), 1.0, rtol=0.05)


def test_what_shines_from_afar_is_drawn_a_scene_away() -> None:
    floor = rectangle((0, 0, 0), (4, 0, 0), (0, 4, 0))
    sun = SunLight((0.0, 0.0, -1.0), 3.0)
    record = record_links(solved(gray_scene(floor, lights=[sun]), error=3e-3))
    start, end, arriving = record.reaching(leaves_on(record, np.arange(2)))
    assert len(end)
    np.testing.assert_allclose(end - start, np.tile([0.0, 0.0, 4.0], (len(end), 1)), atol=1e-6)
    np.testing.assert_allclose(arriving, 3.0, rtol=1e-5)


@pytest.mark.parametrize("method", ["shooting", "multi-level"])
def test_every_method_has_a_record(method: str) -> None:
    settings = SolverSettings(method=method, elements=60)
    state = solve_by_method(lamp_room(), settings)
    record = record_links(state)
    assert record.leaf.any()
    lamps = record.source >= record.n_clusters + len(record.corners)
    assert lamps.any()
    assert (~lamps).any() == (method == "multi-level")


def test_the_nearest_leaf_is_the_one_below_the_point() -> None:
    record = record_links(solved(lamp_room(), error=3e-3))
    for leaf in np.flatnonzero(record.leaf & record.front)[::7]:
        a, b, c = record.corners[leaf].astype(float)
        normal = np.cross(b - a, c - a)
        point = (0.5 * a + 0.3 * b + 0.2 * c) + 1e-3 * normal / np.linalg.norm(normal)
        assert nearest_leaf(record, point) == leaf
    outside = nearest_leaf(record, np.array([30.0, 0.1, 0.1]))
    assert outside is not None
    np.testing.assert_allclose(record.corners[outside][:, 0], 3.0)


def test_a_record_is_small() -> None:
    state = solved(furnished(), error=3e-3)
    record = record_links(state)
    assert len(record.receiver) == state.n_links
    # A link takes 12 bytes, where the solver's own takes 52.
    assert (
        record.nbytes < 12 * state.n_links + 60 * state.hierarchy.n_elements + 60 * state.hierarchy.n_clusters
    )
