"""Light through glass: closed forms, conservation, and what a scene without the glass has."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from radiosity_addon.numerics import irradiance_under_sky
from radiosity_addon.solver import (
    EnvironmentLight,
    PointLight,
    Scene,
    Solution,
    SolverSettings,
    SunLight,
    solve,
)
from tests.glass_rooms import COLOR, WHOLE, closed_pane, floor, glazed, painted_boxes, pane
from tests.rooms import box_room, gray, rectangle, solid_box

POINTS = np.array([(0.1, 0.2, 0.0), (0.5, -0.3, 0.0), (-0.4, 0.6, 0.0)])
UP = np.tile((0.0, 0.0, 1.0), (3, 1))

LAMPS = {
    "point": PointLight((0.1, 0.0, 2.0), (10.0, 20.0, 30.0)),
    "soft": PointLight((0.1, 0.0, 2.0), (10.0, 20.0, 30.0), radius=0.2),
    "sun": SunLight((0.2, 0.1, -1.0), (3.0, 2.0, 1.0), angle=0.02),
}

PANES = pytest.mark.parametrize(
    ("glass", "crossings"), [(pane(), 1), (closed_pane(), 2)], ids=["thin", "closed"]
)

HALF = 1.0 / 2048.0
"""Tints of gather rays are kept in half precision."""


def plain(matte: np.ndarray, reflectance: float = 0.0, **given: Any) -> Scene:
    given = {"emission": np.zeros((len(matte), 3)), **given}
    return Scene(matte, gray(len(matte), reflectance), two_sided=True, **given)


def solved(scene: Scene, **settings: Any) -> Solution:
    return solve(scene, SolverSettings(**settings))


@pytest.mark.parametrize("lamp", LAMPS)
@PANES
def test_light_of_lamps_is_multiplied_by_the_color_at_every_crossing(
    lamp: str, glass: np.ndarray, crossings: int
) -> None:
    lights = (LAMPS[lamp],)
    open_ = solved(plain(floor(), lights=lights))
    found = solved(glazed(floor(), glass, lights=lights))
    tint = COLOR**crossings
    np.testing.assert_allclose(found.irradiance(POINTS, UP), open_.irradiance(POINTS, UP) * tint, rtol=1e-6)
    # Over links of light, whose samples start elsewhere on elements: their own noise, which is gray.
    ratio = found.triangle_irradiance[:2] / open_.triangle_irradiance[:2]
    np.testing.assert_allclose(ratio, np.broadcast_to(tint, (2, 3)), rtol=2e-3)


@PANES
def test_light_of_the_sky_is_multiplied_too(glass: np.ndarray, crossings: int) -> None:
    """The pane is a box around the floor here, or some of the sky would pass it by."""
    boxes = [solid_box((-3, -3, -1), (3, 3, 1)), solid_box((-4, -4, -2), (4, 4, 2))][:crossings]
    sky = EnvironmentLight((1.0, 2.0, 3.0))
    found = solved(glazed(floor(), np.concatenate(boxes), lights=(sky,)))
    expected = irradiance_under_sky(np.array([1.0, 2.0, 3.0])) * COLOR**crossings
    np.testing.assert_allclose(found.irradiance(POINTS, UP), np.tile(expected, (3, 1)), rtol=2 * HALF)
    np.testing.assert_allclose(found.triangle_irradiance[:2], np.tile(expected, (2, 1)), rtol=1e-5)


@PANES
def test_emissive_faces_shine_through_over_links_and_as_lamps(glass: np.ndarray, crossings: int) -> None:
    """Floor and panel are black: what arrives has come straight through."""
    panel = rectangle((-0.5, -0.5, 2.0), (0, 1, 0), (1, 0, 0))
    matte, emission = np.concatenate([floor(), panel]), np.zeros((4, 3))
    emission[2:] = (5.0, 6.0, 7.0)
    open_ = solved(plain(matte, emission=emission))
    found = solved(glazed(matte, glass, emission=emission))
    tint = COLOR**crossings
    np.testing.assert_allclose(found.irradiance(POINTS, UP), open_.irradiance(POINTS, UP) * tint, rtol=1e-6)
    ratio = found.triangle_irradiance[:2] / open_.triangle_irradiance[:2]
    np.testing.assert_allclose(ratio, np.broadcast_to(tint, (2, 3)), rtol=2e-3)


def test_reflected_light_is_tinted_where_it_is_gathered() -> None:
    """A lit floor below a pane, seen by a black ceiling above it: one bounce, one more crossing."""
    ceiling = rectangle((-1, -1, 1.5), (0, 2, 0), (2, 0, 0))
    matte = np.concatenate([floor(), ceiling])
    # The lamp is below the pane, so that only what is reflected crosses it.
    lights = (PointLight((0.0, 0.0, 0.3), (10.0, 10.0, 10.0)),)
    reflectance = gray(4, 0.0)
    reflectance[:2] = 0.8
    open_ = solved(Scene(matte, reflectance, gray(4, 0.0), two_sided=True, lights=lights))
    scene = glazed(matte, pane(0.6), lights=lights)
    scene.reflectance[:2] = 0.8
    found = solved(scene)
    points, down = POINTS + np.array((0, 0, 1.5)), -UP
    # The lamp itself shines on the ceiling, through the pane: black floors leave that alone.
    black = solved(glazed(matte, pane(0.6), lights=lights)).irradiance(points, down)
    alone = solved(plain(matte, lights=lights)).irradiance(points, down)
    bounced, through = open_.irradiance(points, down) - alone, found.irradiance(points, down) - black
    np.testing.assert_allclose(through / through[:, :1], np.tile(COLOR / COLOR[0], (3, 1)), rtol=2 * HALF)
    # The floor's elements are others, and so is their noise.
    np.testing.assert_allclose(through, bounced * COLOR, rtol=0.03)


@pytest.mark.parametrize("walls", [1, 2])
def test_a_lamp_in_a_globe(walls: int) -> None:
    sizes = (0.2, 0.15)[:walls]
    globe = np.concatenate([solid_box((-s, -s, 1 - s), (s, s, 1 + s)) for s in sizes])
    lights = (PointLight((0.0, 0.0, 1.0), (10.0, 20.0, 30.0), radius=0.05),)
    open_ = solved(plain(floor(), lights=lights)).irradiance(POINTS, UP)
    found = solved(glazed(floor(), globe, lights=lights)).irradiance(POINTS, UP)
    np.testing.assert_allclose(found, open_ * COLOR**walls, rtol=1e-6)


@pytest.mark.parametrize("light", ["lamp", "panel", "sky"])
def test_power_is_absorbed_by_surfaces_and_glass_or_escapes(light: str) -> None:
    """A room in two halves, and one open to the outside."""
    room, surface = box_room((2, 1, 1))
    matte = room if light != "sky" else room[surface != 3]
    emission = np.zeros((len(matte), 3))
    lights: tuple[Any, ...] = ()
    if light == "lamp":
        lights = (PointLight((0.5, 0.5, 0.5), (10.0, 20.0, 30.0)),)
    elif light == "panel":
        emission[:2] = (3.0, 2.0, 1.0)
    else:
        lights = (EnvironmentLight((1.0, 2.0, 3.0)),)
    glass = np.concatenate([rectangle((x, 0, 0), (0, 1, 0), (0, 0, 1)) for x in (1.0, 1.05)])
    watts = solved(glazed(matte, glass, reflectance=0.6, emission=emission, lights=lights)).report["power_W"]
    assert watts["absorbed"] + watts["escaped"] == pytest.approx(watts["emitted"], rel=0.01)
    assert 0.05 * watts["absorbed"] < watts["absorbed_by_glass"] < watts["absorbed"]
    if light == "lamp":  # panels shine to the outside, too
        assert watts["escaped"] == pytest.approx(0.0, abs=1e-4 * watts["emitted"])


@pytest.mark.parametrize("boxes", [(0.3,), (0.3, 0.2)], ids=["one box", "two boxes"])
def test_glass_and_paint_together_make_no_light(boxes: tuple[float, ...]) -> None:
    """Under a sky of radiance 1 nothing gets more than π, whatever it reflects and passes."""
    found = solved(painted_boxes(*boxes)).triangle_irradiance
    assert found.max() <= np.pi * (1 + 1e-6)


def test_white_glass_is_not_there() -> None:
    """Nothing is traced that takes nothing: the same links, light and rays."""
    room, _ = box_room((2, 1, 1))
    lights = (PointLight((0.5, 0.5, 0.5), (10.0, 20.0, 30.0)),)
    glass = rectangle((1.0, 0, 0), (0, 1, 0), (0, 0, 1))
    open_ = solved(plain(room, 0.6, lights=lights))
    found = solved(glazed(room, glass, WHOLE, reflectance=0.6, lights=lights))
    np.testing.assert_array_equal(found.triangle_irradiance[: len(room)], open_.triangle_irradiance)
    assert found.report["power_W"] == {**open_.report["power_W"], "absorbed_by_glass": 0.0}
    assert found.report["links"] == open_.report["links"]


def test_gray_glass_is_the_same_veil_as_an_opacity() -> None:
    """By color or by chance, the mean light in both halves of a room is the same."""
    room, _ = box_room((2, 1, 1))
    lights = (PointLight((0.5, 0.5, 0.5), (10.0, 20.0, 30.0)),)
    glass = rectangle((1.0, 0, 0), (0, 1, 0), (0, 0, 1))
    by_color = glazed(room, glass, 0.4 * WHOLE, reflectance=0.6, lights=lights)
    by_chance = glazed(room, glass, 0.4 * WHOLE, reflectance=0.6, lights=lights)
    images = by_chance.images
    assert images is not None
    by_chance.images = type(images)(images.values, images.image_uv, images.textured)
    one, other = solved(by_color), solved(by_chance)
    np.testing.assert_allclose(
        one.triangle_irradiance[: len(room)], other.triangle_irradiance[: len(room)], rtol=0.02
    )


@pytest.mark.parametrize("method", ["two-level", "shooting", "gauss-seidel", "multi-level"])
def test_other_methods_keep_the_power_with_the_mean_of_colors(method: str) -> None:
    room, _ = box_room((2, 1, 1), 2)
    lights = (PointLight((0.5, 0.5, 0.5), (20.0, 20.0, 20.0)),)
    glass = rectangle((1.0, 0, 0), (0, 1, 0), (0, 0, 1))
    settings = SolverSettings(method=method, elements=400)
    watts = solve(glazed(room, glass, reflectance=0.5, lights=lights), settings).report["power_W"]
    assert watts["absorbed"] + watts["escaped"] == pytest.approx(watts["emitted"], rel=0.05)
