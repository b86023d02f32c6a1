"""Light links: the irradiance of lamps and sky on the quarters of elements."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from radiosity_addon.lights.sun_and_sky import light_strengths
from radiosity_addon.numerics.triangles import split_in_four
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver import AreaLight, EnvironmentLight, PointLight, SpotLight, SunLight
from radiosity_addon.solver.hierarchy.nodes import LEAF, Hierarchy
from radiosity_addon.solver.links import light_links
from radiosity_addon.solver.links.light_links import (
    LightLinks,
    link_lights,
    measure_light,
    no_light_links,
)
from radiosity_addon.solver.links.light_samples import sky_share
from radiosity_addon.solver.links.transport import push
from tests.rooms import box_room, gray_scene, rectangle, solid_box

FLOOR = rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0))

LAMPS = {
    "point": PointLight((0.7, 0.9, 1.0), 1.0, radius=0.1),
    "sphere": PointLight((0.7, 0.9, 1.0), 1.0, radius=0.1, soft_falloff=False),
    "spot": SpotLight((1, 1, 3.0), (0.1, 0, -1), 1.0, angle=1.2, blend=0.5, radius=0.05),
    "sun": SunLight((0.3, 0.2, -1), 1.0, angle=0.05),
    "area": AreaLight((1.2, 0.8, 1.5), (0, 0.5, 0), (0.4, 0, 0), 1.0),
}


def setting(triangles: np.ndarray, **changed: Any) -> tuple[Hierarchy, EmbreeCaster]:
    scene = gray_scene(triangles, 0.5, **changed)
    return Hierarchy(scene), EmbreeCaster(triangles)


def quarter_means(light: Any, triangle: np.ndarray, normal: np.ndarray, fine: int = 5) -> np.ndarray:
    """Return (4,) unoccluded irradiance on a triangle's quarters by fine quadrature."""
    parts = split_in_four(triangle[None])[0][:, None]
    for _ in range(fine):
        parts = split_in_four(parts.reshape(-1, 3, 3)).reshape(4, -1, 3, 3)
    centers = parts.mean(axis=2).reshape(-1, 3)
    values = light.unit_irradiance(centers, np.tile(normal, (len(centers), 1)))
    return np.asarray(values.reshape(4, -1).mean(axis=1))


@pytest.mark.parametrize("name", LAMPS)
def test_gain_on_quarters_is_the_mean_irradiance_there(name: str) -> None:
    """After refinement, leaf by leaf, against the closed form on a fine grid."""
    light = LAMPS[name]
    hierarchy, caster = setting(FLOOR)
    made = link_lights(hierarchy, [light], caster, 1e-4, 1e-3, seed=1)
    assert (made.light == 0).all()
    assert (np.diff(np.sort(made.receiver)) > 0).all()
    assert (hierarchy.first_child[made.receiver] == LEAF).all()
    area = hierarchy.area[made.receiver]
    exact = np.array(
        [quarter_means(light, hierarchy.corners[r], np.array([0, 0, 1.0]), 3) for r in made.receiver]
    )
    scale = exact.max()
    np.testing.assert_allclose(made.gain, exact, atol=0.02 * scale)
    assert area @ made.gain.mean(axis=1) == pytest.approx(area @ exact.mean(axis=1), rel=2e-3)


def test_a_small_pool_of_light_on_a_large_floor_is_found() -> None:
    """A narrow spot lights a fortieth of the floor, in neither triangle's middle: all its flux arrives."""
    floor = rectangle((-3, -3, 0), (6, 0, 0), (0, 6, 0))
    for angle, at in ((1.0, (0.0, 0.0, 1.0)), (0.5, (1.3, -0.4, 2.0))):
        light = SpotLight(at, (0, 0, -1), 1.0, angle=angle, blend=0.3)
        hierarchy, caster = setting(floor)
        made = link_lights(hierarchy, [light], caster, 1e-3 * light.flux[0], 1e-3, seed=1)
        flux = hierarchy.area[made.receiver] @ made.gain.mean(axis=1)
        assert flux == pytest.approx(light.flux[0], rel=0.02)


def test_sky_on_a_plane_and_under_a_roof() -> None:
    """π in the open; under a roof what the complement of its exact factor leaves."""
    sky = EnvironmentLight(1.0)
    hierarchy, caster = setting(FLOOR)
    gain, error = measure_light(hierarchy, sky, caster, np.arange(2), seed=0)
    assert (gain == np.pi).all()
    assert (error == 0).all()
    # Equal parallel unit squares at distance 1: F = 0.19982 (Howell C-11).
    below, above = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), 6), rectangle((0, 0, 1), (0, 1, 0), (1, 0, 0))
    hierarchy, caster = setting(np.concatenate([below, above]))
    made = link_lights(hierarchy, [sky], caster, 1e-3, 1e-4, seed=0)
    total = push(hierarchy, made.irradiance(np.ones((1, 3)), hierarchy.n_elements))[:, 0]
    leaves = hierarchy.leaves
    floor = leaves[hierarchy.face[leaves] < len(below)]
    mean = hierarchy.area[floor] @ total[floor] / hierarchy.area[floor].sum()
    assert mean == pytest.approx(np.pi * (1 - 0.19982), rel=0.005)


def test_the_skys_share_at_points() -> None:
    room = box_room()[0]
    caster = EmbreeCaster(room[1:])  # half the floor is missing
    points = np.array([[0.5, 0.5, 0.5]] * 2)
    normals = np.array([[0, 0, 1.0], [0, 0, -1]])
    sky = EnvironmentLight(1.0)
    share, error = sky_share(sky, points, normals, 4096, caster, np.arange(2), seed=0)
    assert share[0] == 0
    # The missing half seen from the middle: half the factor of the whole square below.
    assert share[1] == pytest.approx(0.5 * 4 * 0.1385316, abs=0.01)
    spread = np.repeat(points[:, None], 4096, axis=1)
    np.testing.assert_allclose(error, np.sqrt(share * (1 - share) / 4096), rtol=1e-6)
    again, _ = sky_share(sky, spread, normals, 4096, caster, np.arange(2), seed=0)
    np.testing.assert_array_equal(again, share)


@pytest.mark.parametrize("name", ["point", "area", "sun"])
def test_an_occluder_hides_its_share(name: str) -> None:
    """Total flux on the floor with a plate in the way, against dense shadow rays."""
    light = LAMPS[name]
    plate = rectangle((0.5, 0.4, 0.4), (0.5, 0, 0), (0, 0.7, 0))
    hierarchy, caster = setting(np.concatenate([FLOOR, plate]))
    made = link_lights(hierarchy, [light], caster, 1e-4, 2e-4, seed=1)
    on_floor = hierarchy.face[made.receiver] < 2
    flux = hierarchy.area[made.receiver][on_floor] @ made.gain[on_floor].mean(axis=1)
    rng = np.random.default_rng(3)
    points = np.concatenate([rng.uniform(0, 2, (40000, 2)), np.zeros((40000, 1))], axis=1)
    up = np.tile([0, 0, 1.0], (40000, 1))
    directions, distances, _ = light.shadow_rays(points, up, rng.uniform(size=(40000, 1, 2)))
    start = points + np.array([0, 0, caster.surface_offset])
    free = caster.unoccluded(start, directions[:, 0], distances[:, 0])
    expected = 4 * (light.unit_irradiance(points, up) * free).mean()
    assert free.mean() < 0.97
    assert flux == pytest.approx(expected, rel=0.015)


def test_lights_are_linked_apart_and_their_light_adds_up() -> None:
    """Two lamps and a dark one: each element's light is the sum of what each gives alone."""
    dark = PointLight((1, 1, 1), 0.0)
    red, sky = PointLight((0.5, 0.5, 1), (3.0, 1.0, 0.0)), EnvironmentLight((0.0, 0.0, 2.0))
    lights = [dark, red, sky]
    triangles = np.concatenate([FLOOR, solid_box((1.2, 1.2, 0.1), (1.5, 1.5, 0.6))])
    hierarchy, caster = setting(triangles)
    made = link_lights(hierarchy, lights, caster, 1e-2, 1e-3, seed=0)
    assert set(made.light.tolist()) == {1, 2}
    strengths = light_strengths(lights)
    np.testing.assert_array_equal(strengths, [[0, 0, 0], [3, 1, 0], [0, 0, 2]])
    total = made.irradiance(strengths, hierarchy.n_elements)
    assert total.shape == (hierarchy.n_elements, 4, 3)
    for number in (1, 2):
        rows = made.light == number
        part = LightLinks(made.receiver[rows], made.light[rows], made.gain[rows])
        own = part.irradiance(strengths, hierarchy.n_elements)
        channels = np.flatnonzero(strengths[number])
        np.testing.assert_allclose(total[..., channels], own[..., channels], rtol=1e-6)
    # Each light tiles what it reaches: no element is linked to it together with an ancestor.
    for number in (1, 2):
        linked = set(made.receiver[made.light == number].tolist())
        for element in linked:
            parent = int(hierarchy.parent[element])
            while parent != LEAF:
                assert parent not in linked
                parent = int(hierarchy.parent[parent])


def test_backs_and_shadows_get_no_links() -> None:
    hierarchy, caster = setting(FLOOR[:, ::-1])
    assert len(link_lights(hierarchy, list(LAMPS.values()), caster, 1e-3, 1e-3, seed=0)) == 0
    covered = np.concatenate([FLOOR, rectangle((-4, -4, 0.2), (9, 0, 0), (0, 9, 0))])
    hierarchy, caster = setting(covered)
    made = link_lights(hierarchy, [LAMPS["point"]], caster, 1e-3, 1e-3, seed=0)
    assert not np.isin(hierarchy.face[made.receiver], [0, 1]).any()
    assert len(made) > 0


def test_smaller_tolerance_means_more_links_and_none_below_the_least_area() -> None:
    counts = []
    for tolerance in (1e-2, 1e-5, 1e-6):
        hierarchy, caster = setting(FLOOR)
        counts.append(len(link_lights(hierarchy, [LAMPS["point"]], caster, tolerance, 1e-4, seed=0)))
        assert hierarchy.area.min() >= 1e-4
    assert counts == sorted(counts)
    assert counts[0] < counts[-1]


def test_chunks_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    triangles = np.concatenate([FLOOR, solid_box((1.2, 1.2, 0.1), (1.5, 1.5, 0.6))])
    results = []
    for chunk in (light_links.CHUNK, 7):
        monkeypatch.setattr(light_links, "CHUNK", chunk)
        hierarchy, caster = setting(triangles)
        made = link_lights(hierarchy, [LAMPS["area"], EnvironmentLight(1.0)], caster, 1e-2, 1e-3, seed=5)
        results.append((made.receiver.tobytes(), made.light.tobytes(), made.gain.tobytes()))
    assert results[0] == results[1]


def test_no_lights() -> None:
    hierarchy, caster = setting(FLOOR)
    made = link_lights(hierarchy, [], caster, 1e-3, 1e-3, seed=0)
    assert len(made) == len(no_light_links()) == 0
    assert light_strengths([]).shape == (0, 3)
    assert not made.irradiance(light_strengths([]), 2).any()
