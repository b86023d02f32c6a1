"""Backs inside closed, opaque solids have no faces; all others do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from radiosity_addon.scene.closed_solids import places
from radiosity_addon.solver import AreaLight, PointLight, SolverSettings, SpotLight, SunLight, solve
from tests.rooms import box_room, gray, gray_scene, rectangle, solid_box, sphere

BOX = solid_box((1.0, 1.0, 0.0), (2.0, 2.0, 1.5))
SUN = SunLight((0.3, 0.2, -1.0), 3.0)


def sealed(triangles: np.ndarray, **more: Any) -> np.ndarray:
    return gray_scene(triangles, two_sided=True, **more).sealed


def moved_through_a_matrix(triangles: np.ndarray) -> np.ndarray:
    """As an export carries meshes into the world."""
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    return triangles @ (turn * np.sign(np.linalg.det(turn))).T + (0.1, -7.3, 2.2)


def test_the_inside_of_a_closed_solid_is_sealed() -> None:
    ball = sphere(3)[:, ::-1]
    assert sealed(BOX).all()
    assert sealed(moved_through_a_matrix(ball)).all()
    assert sealed(np.concatenate([BOX, ball + 9.0]), lights=[SUN]).all()


def test_open_and_inverted_surfaces_are_not() -> None:
    assert not sealed(BOX[:-1]).any()
    assert not sealed(BOX[:, ::-1]).any()
    one_turned = BOX.copy()
    one_turned[4] = one_turned[4, ::-1]
    assert not sealed(one_turned).any()
    # A leaf with two sides encloses nothing.
    leaf = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), 3)
    assert not sealed(np.concatenate([leaf, leaf[:, ::-1]])).any()


def test_each_solid_of_several_is_judged_by_itself() -> None:
    """Also where they touch along an edge, and where an open surface ends at a solid's edge."""
    beside = BOX + np.array((1.0, 1.0, 0.0))
    wing = rectangle((1.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.5))
    parts = np.concatenate([BOX, beside, wing, BOX[:-2] + 5.0])
    found = sealed(parts)
    np.testing.assert_array_equal(found[12:24], True)
    assert not found[24:].any()


@pytest.mark.parametrize(
    "light",
    [
        PointLight((1.5, 1.5, 0.5), 0.0),
        SpotLight((1.5, 1.5, 2.0), (0, 0, -1.0), 10.0, angle=1.0, radius=0.6),
        AreaLight((1.5, 1.5, 1.6), (0.0, 0.5, 0.5), (0.5, 0.0, 0.0), 10.0),
        SunLight((0.3, 0.2, -1.0), 3.0, casts_shadow=False),
    ],
)
def test_no_light_may_be_inside(light: Any) -> None:
    """A dark lamp may be lit later, and light without shadows goes everywhere."""
    assert not sealed(BOX, lights=[light]).any()
    if light.casts_shadow:
        assert sealed(np.concatenate([BOX, BOX + 7.0]), lights=[light])[12:].all()


def test_nothing_that_shines_or_lets_light_through_seals() -> None:
    glowing, passing = gray(24, 0.0), np.arange(24) != 3
    glowing[13] = 1.0
    inside = np.concatenate([BOX, 0.5 * BOX + (0.75, 0.75, 0.2)])
    assert not sealed(inside, emission=glowing)[:12].any()
    apart = np.concatenate([BOX, BOX + 7.0])
    np.testing.assert_array_equal(sealed(apart, emission=glowing), np.arange(24) < 12)
    for role in ("in_bounces", "in_shadows"):
        np.testing.assert_array_equal(sealed(apart, **{role: passing}), np.arange(24) >= 12)


def test_sealed_backs_have_no_faces_and_the_light_is_the_same() -> None:
    """A room with a block in it: outside of the block nothing changes but noise."""
    room, _ = box_room((3, 3, 2.5), 2)
    triangles = np.concatenate([room, BOX])
    scene = gray_scene(triangles, lights=[PointLight((0.5, 0.6, 2.0), 100.0)], two_sided=True)
    settings = SolverSettings(error=3e-5, threads=1)
    solution = solve(scene, settings)
    assert not solution.back_irradiance[-12:].any()
    # A dark lamp in the block keeps its inside.
    lamps = [*scene.lights, PointLight((1.5, 1.5, 0.5), 0.0)]
    expected = solve(gray_scene(triangles, lights=lamps, two_sided=True), settings)
    assert expected.report["elements"] > solution.report["elements"]
    for found, known in (
        (solution.triangle_irradiance, expected.triangle_irradiance),
        (solution.back_irradiance[:-12], expected.back_irradiance[:-12]),
    ):
        np.testing.assert_allclose(found, known, rtol=0.03, atol=0.02 * known.max())
    power = solution.report["power_W"]
    assert power["absorbed"] + power["escaped"] == pytest.approx(power["emitted"], rel=0.01)


def test_places_that_are_nearly_opposite_are_two() -> None:
    """Of a ball of a hundred rings: all that differs is signs and some last bits."""
    one = np.array([0.85904342, 0.05404646, 0.50904143], dtype=np.float32)
    other = np.array([-0.85904342, -0.05404658, 0.50904143], dtype=np.float32)
    corners = np.stack([one, other, one]).astype(np.float64)[None]
    assert places(corners).tolist() in ([[0, 1, 0]], [[1, 0, 1]])
