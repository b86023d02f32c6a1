"""What lamps are asked for over footprints: gains, and shadow rays by what a lamp adds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.lights.sun_and_sky import AreaLight, PointLight, SunLight
from radiosity_addon.numerics.sampling import points_on_triangles, stratified_square
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver.emitters.emitters import EmitterGroup
from radiosity_addon.solver.gather.footprints import Footprints, SpreadPoints
from radiosity_addon.solver.gather.soft_shadows import MAIN_PART, ShadowShare
from tests.rooms import rectangle

COUNT = 400
LAMP = AreaLight((0.5, 0.5, 1.0), (0.4, 0, 0), (0, -0.4, 0), 5.0)
"""Shines down on the floor z = 0."""


def floor(expected: float | None = None, width: float = 0.02) -> Footprints:
    """Squares in rows over the unit square."""
    side = int(np.sqrt(COUNT))
    steps = (np.arange(side) + 0.5) / side
    points = np.stack([*np.meshgrid(steps, steps), np.zeros((side, side))], axis=-1).reshape(-1, 3)
    flat = np.zeros((COUNT, 3, 3))
    flat[:, 1, 0] = flat[:, 2, 1] = width
    corners = points[:, None] - width / 3 * np.array([1.0, 1.0, 0.0]) + flat
    return Footprints(
        points,
        np.tile([0.0, 0.0, 1.0], (COUNT, 1)),
        np.arange(COUNT),
        lambda rows, u: points_on_triangles(corners[rows], u),
        expected=None if expected is None else np.full(COUNT, expected),
    )


def _flat(points: np.ndarray) -> np.ndarray:
    return np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)


def _grown(mask: np.ndarray) -> np.ndarray:
    framed = np.pad(mask.reshape(20, 20), 1)
    return np.lib.stride_tricks.sliding_window_view(framed, (3, 3)).any(axis=(2, 3)).ravel()


def share_of(
    at: Footprints, caster: EmbreeCaster, rays: int = 4, threads: int = 1, seed: int = 0
) -> np.ndarray:
    spread = SpreadPoints(at, seed + 2, threads)
    gain = spread.gain(LAMP)
    return ShadowShare(caster, LAMP, spread, seed + 5, threads).at_points(gain, rays)


def blocker() -> EmbreeCaster:
    return EmbreeCaster(rectangle((0.3, 0.3, 0.5), (0.4, 0, 0), (0, 0.4, 0)))


def test_a_gain_is_the_mean_over_the_footprint() -> None:
    """Where it bends most: the center alone would be far off right under a lamp."""
    near = PointLight((0.52, 0.48, 0.03), 1.0, radius=0.0)
    at = replace(floor(width=0.05), near=_grown)
    assert at.sampler is not None
    each = at.sampler(np.arange(COUNT), stratified_square(np.arange(COUNT), 4096, 9)).reshape(-1, 3)
    mean = near.unit_irradiance(each, np.repeat(at.normals, 4096, axis=0)).reshape(COUNT, -1).mean(axis=1)
    own = near.unit_irradiance(at.points, at.normals)
    assert np.abs(own / mean - 1).max() > 0.2
    gain = SpreadPoints(at, 1).gain(near)
    np.testing.assert_allclose(gain, mean, rtol=0.05)
    assert np.abs(gain - mean).mean() < 0.01 * mean.mean()
    # Cells are evaluated at fewer points, and are right on average.
    seeds = [SpreadPoints(replace(at, near=None), seed).gain(near) for seed in range(200)]
    np.testing.assert_allclose(np.mean(seeds, axis=0).sum(), mean.sum(), rtol=0.01)


@pytest.mark.parametrize("part", [1.0, 0.1, 0.02])
def test_a_lamp_that_adds_little_gets_few_rays_and_the_same_mean(part: float) -> None:
    at = floor()
    power = float((LAMP.unit_irradiance(at.points, at.normals) * LAMP.strength.mean()).mean())
    caster, seeds = blocker(), range(0, 80, 10)
    shares = np.array([share_of(floor(power / (part * MAIN_PART)), caster, seed=seed) for seed in seeds])
    truth = share_of(at, blocker(), rays=64)
    # Of all light, the lamp's part of it: what it is wrong by, and its noise.
    assert abs(shares.mean() - truth.mean()) * part < 0.008
    assert np.sqrt(((shares - truth) ** 2).mean()) * part < 0.08
    rays = caster.rays / shares.size
    assert rays < {1.0: 64.0, 0.1: 16.0, 0.02: 4.0}[part]


@pytest.mark.parametrize("angle", [0.0, 0.004])
def test_a_sharp_edge_of_sunlight_leaves_a_footprint_its_lit_part(angle: float) -> None:
    """The edge crosses squares of 0.05 at an angle; its penumbra is as wide as 0.04 of a square at most."""
    side, along = 0.05, np.array([0.6, 0.8])
    at = floor(width=side)
    squares = replace(
        at, sampler=lambda rows, u: at.points[rows, None] + _flat(side * (u - 0.5)), near=_grown
    )
    # Its edge is where x · along = 0.7; past that the floor is in the sun.
    edge = (*(0.7 * along + 5 * np.array([-0.8, 0.6])), 0.5)
    plate = EmbreeCaster(rectangle(edge, (8, -6, 0), (-6, -8, 0)))
    sun = SunLight((0, 0, -1), 1.0, angle=angle)
    share = ShadowShare(plate, sun, SpreadPoints(squares, 2), 5).at_points(np.ones(COUNT), 8)
    # Part of the unit square where x · along is less than `below`.
    below = 0.7 / side - (at.points[:, :2] / side - 0.5) @ along
    corners = np.array([0.0, 0.6, 0.8, 1.4])
    dark = np.maximum(below[:, None] - corners, 0.0) ** 2 @ (1, -1, -1, 1) / (2 * along.prod())
    crossed = (below > -0.1) & (below < 1.5)
    assert crossed.sum() > 25
    np.testing.assert_allclose(share[~crossed], (below < 0)[~crossed], rtol=0, atol=1e-12)
    apart = (share - (1.0 - dark))[crossed]
    assert np.sqrt((apart**2).mean()) < 0.01
    assert np.abs(apart).max() < 0.03


def test_the_threads_change_no_share() -> None:
    one = share_of(floor(1.0), blocker())
    for threads in (2, 3):
        np.testing.assert_array_equal(share_of(floor(1.0), blocker(), threads=threads), one)


def test_a_glowing_edge_next_to_the_center_shines_on_its_part_of_the_footprint() -> None:
    """A wide sheet a hair off the surface begins near a footprint's end: the center gets next to nothing."""
    half, begins, height = 0.5, 0.4, 0.02
    sheet = rectangle((begins, -50, height), (0, 100, 0), (100, 0, 0))
    group = EmitterGroup(sheet, np.tile([0.0, 0.0, -1.0], (2, 1)), np.ones(3), 1e-6)
    center = np.tile([0.0, 0.0, 0.0], (33, 1))
    center[-1, 0] = -3.0

    def across(rows: np.ndarray, u: np.ndarray) -> np.ndarray:
        return center[rows, None] + np.concatenate([half * (2 * u - 1), 0 * u[..., :1]], axis=2)

    at = Footprints(center, np.tile([0.0, 0.0, 1.0], (33, 1)), np.arange(33), across, near=lambda mask: mask)
    gain = SpreadPoints(at, 1).gain(group, 0.05)
    # Where x is past the edge: F = (1 + x/√(x² + h²))/2, whose integral is (x + √(x² + h²))/2.
    ends = np.array([-half, half]) - begins
    expected = np.diff(0.5 * (ends + np.hypot(ends, height)))[0] / (2 * half)
    assert group.unit_irradiance(at.points[:1], at.normals[:1])[0] < 0.01 * expected
    np.testing.assert_allclose(gain[:-1].mean(), expected, rtol=0.02)
    assert np.abs(gain[:-1] / expected - 1.0).max() < 0.15
    # Far from it the center speaks for all.
    assert gain[-1] == group.unit_irradiance(at.points[-1:], at.normals[-1:])[0]


def test_what_lies_next_to_a_face_is_found_by_the_boxes_of_faces() -> None:
    """One box around all faces would take in what lies between them."""
    left = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    right = rectangle((9, 0, 0), (1, 0, 0), (0, 1, 0))
    group = EmitterGroup(np.concatenate([left, right]), np.tile([0.0, 0.0, 1.0], (4, 1)), np.ones(3), 1e-6)
    points = np.array([[0.5, 0.5, 0.3], [1.2, 1.2, 0.0], [5.0, 0.5, 0.0], [9.5, 0.5, -0.5], [12.0, 0.5, 0.0]])
    reach = np.array([0.31, 0.28, 0.3, 0.4, 2.1])
    np.testing.assert_array_equal(group.is_near(points, reach), [True, False, False, False, True])
    assert group.is_near(points[1:2], np.array([0.29]))[0]
