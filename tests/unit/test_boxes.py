"""What passes through boxes: never less than a plain search finds."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lights.environment import SkyPatch, pixel_bounds
from radiosity_addon.lights.sun_and_sky import Lamp
from radiosity_addon.numerics.sampling import stratified_square
from radiosity_addon.solver import AreaLight, PointLight, SpotLight, SunLight
from radiosity_addon.solver.gather.boxes import Boxes

BOXES = Boxes(np.array([(0.0, 0.0, 0.0), (2.0, 2.0, 1.0)]), np.array([(1.0, 0.5, 0.4), (2.5, 2.6, 3.0)]))
COUNT = 200


def points(seed: int, count: int = COUNT) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-2.0, 4.0, (count, 3))


def inside(spots: np.ndarray) -> np.ndarray:
    """(…,) whether points (…, 3) are in a box."""
    within = (spots[..., None, :] >= BOXES.low) & (spots[..., None, :] <= BOXES.high)
    return np.asarray(within.all(axis=-1).any(axis=-1))


def marched(start: np.ndarray, along: np.ndarray, end: float) -> np.ndarray:
    """(n,) whether rays go through a box, by many steps along each."""
    steps = np.linspace(0.0, end, 4000)
    return np.array([inside(a + steps[:, None] * b).any() for a, b in zip(start, along, strict=True)])


@pytest.mark.parametrize("end", [1.0, np.inf], ids=["segments", "rays"])
def test_rays_and_segments_meet_what_marching_finds(end: float) -> None:
    start, along = points(1), points(2) - points(1)
    found = BOXES.met_by(start, along[:, None], np.zeros(COUNT), end)[:, 0]
    expected = marched(start, along, min(end, 30.0))
    assert 10 <= expected.sum() < COUNT - 10
    np.testing.assert_array_equal(found, expected)


def test_rays_along_an_axis_and_from_inside() -> None:
    start = np.array([(-1.0, 0.25, 0.2), (-1.0, 0.75, 0.2), (0.5, 0.25, 0.2), (-1.0, 0.25, 0.2)])
    along = np.array([(1.0, 0, 0), (1.0, 0, 0), (0, 0, 1.0), (-1.0, 0, 0)])[:, None]
    found = BOXES.met_by(start, along, np.zeros(4))[:, 0]
    np.testing.assert_array_equal(found, [True, False, True, False])
    # So much wider it is in the way.
    assert BOXES.met_by(start[1:2], along[1:2], np.array([0.3])).all()


LAMPS = (
    PointLight((-1.0, 3.0, 2.0), 1.0, radius=0.4),
    PointLight((-1.0, 3.0, 2.0), 1.0, radius=0.4, soft_falloff=False),
    SpotLight((4.0, 4.0, 4.0), (-1.0, -1.0, -1.0), 1.0, angle=1.0, radius=0.3),
    AreaLight((3.0, -1.0, 3.0), (1.0, 0.2, 0.0), (0.0, 0.5, 0.5), 1.0),
    SunLight((0.3, 0.4, -1.0), 1.0, angle=0.4),
    SkyPatch(1.0, pixel_bounds((16, 32))[10 * 32 + 4 : 10 * 32 + 7], np.ones(3)),
)


@pytest.mark.parametrize("lamp", LAMPS, ids=lambda lamp: type(lamp).__name__)
def test_no_shadow_ray_meets_a_box_unforeseen(lamp: Lamp) -> None:
    at = points(3)
    normals = np.tile((0.0, 0.0, 1.0), (COUNT, 1))
    foreseen = BOXES.between(at, lamp, np.zeros(COUNT))
    directions, distances, _ = lamp.shadow_rays(at, normals, stratified_square(np.arange(COUNT), 64))
    reach = np.minimum(distances, 30.0)[..., None] * directions
    meets = BOXES.met_by(at, reach, np.zeros(COUNT), 1.0).any(axis=1)
    assert meets.sum() > 5
    assert not (meets & ~foreseen).any()
    # It is of use only if it does not estimate_bake what is far from happening.
    assert foreseen.sum() < COUNT - 20


def test_a_sky_all_around_is_foreseen_everywhere() -> None:
    sky = SunLight((0.0, 0.0, -1.0), 1.0, angle=3.1)
    assert BOXES.between(points(4), sky, np.zeros(COUNT)).all()


def test_what_is_near_and_what_rises_over_planes() -> None:
    at = np.array([(1.2, 0.25, 0.2), (0.5, 0.25, 0.6), (0.5, 0.25, 3.1)])
    np.testing.assert_array_equal(BOXES.near(at, np.array([0.3, 0.1, 0.1])), [True, False, False])
    up = np.array([(0.0, 0.0, 1.0)] * 3)
    np.testing.assert_array_equal(BOXES.above(at, up, np.zeros(3)), [True, True, False])
    np.testing.assert_array_equal(BOXES.above(at, -up, np.zeros(3)), [True, True, True])
