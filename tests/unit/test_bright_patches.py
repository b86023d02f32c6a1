"""Rays aimed at bright elements: the same expectation as cosine-distributed ones, far less noise."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics.sampling import stratified_square
from radiosity_addon.solver import PointLight, SolverSettings, solve
from radiosity_addon.solver.gather import Footprints, GatheredHits, LocalPass
from radiosity_addon.solver.gather.bright_patches import (
    CONTRAST,
    MAX_BRIGHT_ELEMENTS,
    AimedRays,
    BrightElements,
)
from radiosity_addon.solver.gather.hit_numbers import NOTHING
from tests.rooms import box_room, gray_scene, solid_box

RAYS = 64
POINTS = 400
AT = np.array([0.15, 0.8, 0.0])


@pytest.fixture(scope="module")
def local() -> LocalPass:
    """A room with a lamp a hand's breadth off a wall, and a block that hides part of the bright spot."""
    room, _ = box_room((2, 2, 1))
    triangles = np.concatenate([room, solid_box((1.2, 0.9, 0.0), (1.5, 1.2, 0.55))])
    scene = gray_scene(triangles, 0.7, lights=[PointLight((1.93, 1.0, 0.5), 10.0, radius=0.01)])
    return solve(scene, SolverSettings(error=5e-4)).local_pass


def gathered(
    local: LocalPass, rays: int, expected: float | None, seed: int, count: int = POINTS
) -> GatheredHits:
    """Gather `count` times at one place, each time with other samples."""
    up = np.tile([0.0, 0.0, 1.0], (count, 1))
    at = Footprints(np.tile(AT, (count, 1)), up, seed + np.arange(count))
    noise = None if expected is None else np.full(count, expected)
    return local.gather.at(at, up, rays, local.elements.leaves_of, noise)


def irradiance(local: LocalPass, found: GatheredHits) -> np.ndarray:
    """(n,) what the elements' reflected light sends there along the rays."""
    table = np.append(local.elements.reflected()[:, 0], [0.0, 0.0])
    total = table[found.sources].mean(axis=1)
    total[found.aimed.row] += (table[found.aimed.sources] * found.aimed.weights).sum(axis=1)
    return total


def test_the_expectation_stays_and_most_noise_goes(local: LocalPass) -> None:
    plain = irradiance(local, gathered(local, RAYS, None, 0))
    aimed = irradiance(local, gathered(local, RAYS, 1e-9, 10_000))
    brute = irradiance(local, gathered(local, 1 << 13, None, 20_000, count=16))
    spread = np.hypot(brute.std() / np.sqrt(len(brute)), aimed.std() / np.sqrt(len(aimed)))
    assert abs(aimed.mean() - brute.mean()) < 4 * spread
    assert spread < 2e-3 * brute.mean()
    # A quarter more rays: what it costs is much less than what it brings.
    assert aimed.std() < 0.4 * plain.std()


def test_neighboring_texels_differ_little(local: LocalPass) -> None:
    """No blotches: a smooth floor's points differ by less than 3 % of their value, at 64 rays."""
    aimed = irradiance(local, gathered(local, RAYS, 1e-9, 0))
    assert aimed.std() < 0.03 * aimed.mean()


def test_what_is_aimed_at_is_left_out_by_other_rays(local: LocalPass) -> None:
    bright = BrightElements(local.elements.state.hierarchy, local.elements.reflected())
    found = gathered(local, RAYS, 1e-9, 0)
    assert len(found.aimed.row) == POINTS
    shares = bright.shares(AT[None], np.array([[0.0, 0.0, 1.0]]), RAYS, np.array([1e-9]))[0]
    aims = bright.element[shares > 0]
    assert len(aims) > 0
    assert not np.isin(found.sources, aims).any()
    hit = found.aimed.sources != NOTHING
    assert np.isin(found.aimed.sources[hit], aims).all()
    assert (~hit).any(), "the block should hide something"
    # From there the weights are the factors: together what the unhidden elements fill of the hemisphere.
    assert (found.aimed.weights.sum(axis=1) < 0.05).all()


def test_bright_elements_are_few_and_far_above_the_mean(local: LocalPass) -> None:
    hierarchy, reflected = local.elements.state.hierarchy, local.elements.reflected()
    bright = BrightElements(hierarchy, reflected)
    leaves = hierarchy.leaves
    mean = reflected[leaves, 0] @ hierarchy.area[leaves] / hierarchy.area[leaves].sum()
    assert 0 < len(bright) <= MAX_BRIGHT_ELEMENTS
    assert (reflected[bright.element, 0] > CONTRAST * mean).all()
    assert (hierarchy.first_child[bright.element] < 0).all()
    others = np.setdiff1d(leaves, bright.element)
    assert reflected[others, 0].max() <= max(CONTRAST * mean, reflected[bright.element, 0].min())


def test_nothing_is_aimed_where_chance_does_no_harm(local: LocalPass) -> None:
    found = gathered(local, RAYS, 1e9, 0)
    plain = gathered(local, RAYS, None, 0)
    assert len(found.aimed.row) == 0
    np.testing.assert_array_equal(found.sources, plain.sources)


def test_an_even_enclosure_has_no_bright_elements() -> None:
    triangles, _ = box_room()
    scene = gray_scene(triangles, 0.5, 1.0)
    local = solve(scene, SolverSettings(error=1e-3)).local_pass
    assert len(BrightElements(local.elements.state.hierarchy, local.elements.reflected())) == 0


def test_joined_rays_keep_their_points() -> None:
    one = AimedRays(np.array([1]), np.array([[5, 6]], np.int32), np.ones((1, 2), np.float32))
    two = AimedRays(np.array([0, 2]), np.array([[7, 8], [9, 1]], np.int32), np.ones((2, 2), np.float32))
    joined = AimedRays.joined([one, AimedRays.none(), two], [0, 4, 10])
    np.testing.assert_array_equal(joined.row, [1, 10, 12])
    np.testing.assert_array_equal(joined.sources, [[5, 6], [7, 8], [9, 1]])
    assert len(AimedRays.joined([], []).row) == 0


def test_rays_aim_at_the_bright_spot_on_a_large_element() -> None:
    """A lamp a hand's breadth off a wall lights a spot that is smaller than the elements may be."""
    room, _ = box_room((2, 2, 1))
    lamp = PointLight((1.93, 1.0, 0.5), 10.0, radius=0.01)
    scene = gray_scene(room, 0.7, lights=[lamp])
    local = solve(scene, SolverSettings(error=1e-2, min_area=2e-3)).local_pass
    even = BrightElements(local.elements.state.hierarchy, local.elements.reflected())
    spot = local.gather.bright_elements
    np.testing.assert_array_equal(even.element, spot.element)
    plain, aimed = (sent_by_the_lamps_wall(bright, lamp) for bright in (even, spot))
    noise = np.hypot(plain.std(), aimed.std()) / np.sqrt(POINTS)
    assert abs(plain.mean() - aimed.mean()) < 4 * noise
    assert aimed.std() < 0.6 * plain.std()


def sent_by_the_lamps_wall(bright: BrightElements, lamp: PointLight) -> np.ndarray:
    """(POINTS,) estimates, 16 rays each, of ∫ E κ over the bright elements of x = 2, E the lamp's light."""
    up, at = np.tile([0.0, 0.0, 1.0], (POINTS, 1)), np.tile(AT, (POINTS, 1))
    shares = bright.shares(at, up, RAYS, np.full(POINTS, 1e-9))
    start = np.repeat(at[:, None], 16, axis=1)
    aim = bright.aim(start, up, shares, stratified_square(np.arange(POINTS), 16, 1))
    reach = (2.0 - AT[0]) / aim.directions[..., :1]
    targets = (AT + reach * aim.directions).reshape(-1, 3)
    level = lamp.unit_irradiance(targets, np.tile([-1.0, 0.0, 0.0], (len(targets), 1)))
    return (level.reshape(aim.weights.shape) * aim.weights).sum(axis=1)
