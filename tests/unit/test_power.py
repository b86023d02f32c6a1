"""Where the power goes: emitted, absorbed, escaped, each counted by itself."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.scene.faces import Faces
from radiosity_addon.solver import AreaLight, EnvironmentLight, PointLight, Scene, SpotLight, SunLight
from radiosity_addon.solver.state.lamp_power import light_power
from radiosity_addon.solver.state.power import link_closure, power_balance
from tests.rooms import CEILING, box_room, gray, gray_scene, rectangle
from tests.unit.solved_rooms import furnished, solved

FLOOR = rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0))

SHARE = np.arcsin(0.2) / np.pi
"""Of all directions, those that a square fills from its width above its middle."""


def balance(scene: Scene, **settings: float) -> dict[str, float]:
    return power_balance(solved(scene, **settings))


def test_unit_of_power() -> None:
    """All sides' emission, lamps, what sun and sky would send onto the scene's box: the largest channel."""
    triangles = np.concatenate([FLOOR, FLOOR + np.array([0, 0, 3])])
    emission = np.tile([1.0, 3.0, 2.0], (4, 1)) * [[1], [1], [0], [0]]
    lights = [
        PointLight((0, 0, 1), (5.0, 10.0, 0.0)),
        SunLight((0, 0, -1), 2.0),
        EnvironmentLight((0.0, 1.0, 9.0)),
    ]
    scene = gray_scene(
        triangles, 0.5, emission, two_sided=np.array([True, False, False, False]), lights=lights
    )
    green = 3 * (2 + 2 + 2) + 10 + 2 * 4 + np.pi * (4 + 6 + 6)
    blue = 2 * 6 + 0 + 2 * 4 + 9 * np.pi * 16
    assert light_power(scene, Faces(scene)) == pytest.approx(max(green, blue), rel=1e-12)
    empty = gray_scene(np.zeros((0, 3, 3)), lights=lights)
    assert light_power(empty, Faces(empty)) == 0.0


@pytest.mark.parametrize(
    ("lamp", "up"),
    [
        (PointLight((0, 0, 1), 100.0), 0.5),
        (SpotLight((0, 0, 1), (0, 0, 1), 100.0, angle=1.0, blend=0.0), 1.0),
        (SpotLight((0, 0, 9), (0, 0, -1), 100.0, angle=2.0, blend=0.3), 0.0),
        (AreaLight((0, 0, 1), (0, 0.1, 0), (0.1, 0, 0), 100.0), 0.0),
        (AreaLight((0, 0, 1), (0.1, 0, 0), (0, 0.1, 0), 100.0), 1.0),
    ],
)
def test_lamps_over_a_black_floor(lamp, up: float) -> None:
    """What goes up escapes, what goes down is absorbed; both are counted, and add up."""
    wide = rectangle((-20, -20, 0), (40, 0, 0), (0, 40, 0))
    power = balance(gray_scene(wide, reflectance=0.0, lights=[lamp]))
    assert power["emitted"] == pytest.approx(lamp.flux.mean(), rel=1e-12)
    assert power["escaped"] == pytest.approx(up * power["emitted"], abs=0.03 * power["emitted"])
    assert power["absorbed"] + power["escaped"] == pytest.approx(power["emitted"], rel=0.005)


def test_sun_and_sky_count_what_arrives() -> None:
    """A sun of 3 W/m² on 4 m², a sky of radiance 2: the floor keeps half and the other half leaves."""
    sun = balance(gray_scene(FLOOR, lights=[SunLight((0, 1, -1), 3.0)]))
    assert sun["emitted"] == pytest.approx(4 * 3 * np.sqrt(0.5), rel=1e-5)
    sky = balance(gray_scene(FLOOR, lights=[EnvironmentLight(2.0)]))
    assert sky["emitted"] == pytest.approx(4 * 2 * np.pi, rel=1e-5)
    for power in (sun, sky):
        assert power["absorbed"] == pytest.approx(0.5 * power["emitted"], rel=1e-5)
        assert power["escaped"] == pytest.approx(0.5 * power["emitted"], rel=1e-3)


@pytest.mark.parametrize(
    ("casts_shadow", "in_shadows", "emitted", "absorbed"),
    [(True, True, 1.0, 1), (False, True, 2 * SHARE, 2), (True, False, 1.0 + SHARE, 2)],
)
def test_light_that_goes_on_behind_a_surface_counts_on_each(
    casts_shadow: bool, in_shadows: bool, emitted: float, absorbed: int
) -> None:
    """A black plate just fills the view of a larger one: one of them has the lamp's light, or both."""
    near = rectangle((-0.5, -0.5, 0), (1, 0, 0), (0, 1, 0))
    far = rectangle((-1, -1, -1), (2, 0, 0), (0, 2, 0))
    scene = gray_scene(
        np.concatenate([near, far]),
        reflectance=0.0,
        in_shadows=np.array([in_shadows, in_shadows, True, True]),
        lights=[PointLight((0, 0, 1), 100.0, casts_shadow=casts_shadow)],
    )
    power = balance(scene, error=1e-3)
    assert power["emitted"] == pytest.approx(100 * emitted, rel=0.005)
    assert power["absorbed"] == pytest.approx(100 * SHARE * absorbed, rel=0.005)
    assert power["absorbed"] + power["escaped"] == pytest.approx(power["emitted"], rel=0.005)


def test_emission_counts_over_both_sides() -> None:
    scene = gray_scene(FLOOR, 0.5, np.tile([1.0, 2.0, 3.0], (2, 1)), two_sided=True)
    power = balance(scene)
    assert power["emitted"] == pytest.approx(2 * 4 * 2.0, rel=1e-12)
    assert power["escaped"] == pytest.approx(power["emitted"], rel=1e-12)
    assert power["absorbed"] == 0


def test_escaped_is_not_the_remainder() -> None:
    """An open cube: what leaves through the missing ceiling is followed there."""
    room, surface = box_room()
    emission = gray(12, 0.0)
    emission[surface == 0] = 1.0
    kept = surface != CEILING
    scene = gray_scene(room[kept], 0.0, emission[kept])
    power = balance(scene, error=1e-3)
    assert power["emitted"] == pytest.approx(1.0, rel=1e-12)
    assert power["escaped"] == pytest.approx(0.19982, abs=0.002)
    assert power["absorbed"] == pytest.approx(1 - 0.19982, abs=0.005)


def test_black_backs_absorb() -> None:
    """A shining one-sided plate above the black back of another: F = 0.19982 of it ends there."""
    shining = rectangle((0, 0, 1), (0, 1, 0), (1, 0, 0))
    upside_down = rectangle((0, 0, 0), (0, 1, 0), (1, 0, 0))
    emission = np.concatenate([gray(2, 1.0), gray(2, 0.0)])
    power = balance(gray_scene(np.concatenate([shining, upside_down]), 0.5, emission))
    assert power["absorbed"] == pytest.approx(0.19982, abs=0.002)
    assert power["escaped"] == pytest.approx(1 - 0.19982, abs=0.002)


def test_closed_room_absorbs_all() -> None:
    power = balance(furnished(), error=5e-4)
    assert power["escaped"] == 0
    assert power["absorbed"] == pytest.approx(power["emitted"], rel=0.005)


def test_closure_counts_own_and_inherited_links() -> None:
    """Per face Σ F V over the links of all its elements, by area: near 1 in a closed scene."""
    state = solved(furnished(), error=1e-3)
    hierarchy, links = state.hierarchy, state.links
    shares = link_closure(hierarchy, state.links)
    np.testing.assert_allclose(shares, 1.0, atol=0.03)
    expected = np.zeros(len(hierarchy.faces))
    weight = links.factor.astype(float) * links.visibility
    for face in range(len(expected)):
        rows = hierarchy.face[links.receiver] == face
        area = hierarchy.area[links.receiver[rows]] / hierarchy.faces.area[face]
        expected[face] = area @ weight[rows]
    np.testing.assert_allclose(shares, expected, rtol=1e-6)


def test_nothing_shines_nothing_counts() -> None:
    lights = [PointLight((0, 0, 1), 0.0), EnvironmentLight(0.0)]
    assert balance(gray_scene(FLOOR, lights=lights)) == {"emitted": 0, "absorbed": 0, "escaped": 0}
