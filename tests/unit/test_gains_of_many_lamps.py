"""Gains of many lamps: in half precision, and of cells by runs of neighbors."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver.gather.light_gains import CompactGains, LightGains
from radiosity_addon.solver.gather.run_gains import WHOLE, RunGains, joined_gains
from tests.unit.test_lamp_group import lamps, places

SUN = 40
"""The number of a light that is in no run."""


def run_gains(seed: int = 1, channels: tuple[int, ...] = ()) -> RunGains:
    """200 points that see parts of 8 runs of 40 lamps, and a sun."""
    random = np.random.default_rng(seed)
    points, normals = places(200)
    gains = RunGains(points + seed, normals, lamps(40), np.arange(40)[::-1], 8, channels)
    gains.seen[:] = random.integers(0, 256, gains.seen.shape)
    gains.put(SUN, random.uniform(0.0, 1.0, 200))
    return gains


def strengths() -> np.ndarray:
    return np.random.default_rng(2).uniform(0.0, 10.0, (41, 3))


@pytest.mark.parametrize("channels", [(), (3,)])
def test_a_lamp_adds_its_unoccluded_light_times_what_is_seen_of_its_run(channels: tuple[int, ...]) -> None:
    gains = run_gains(channels=channels)
    points, normals = (each.astype(np.float64) for each in (gains.points, gains.normals))
    for row in (0, 17, 39):
        open_light = gains.lamps[row].unit_irradiance(points, normals)
        seen = gains.seen[:, row * 8 // 40] / WHOLE
        expected = (seen.T * open_light).T
        np.testing.assert_allclose(gains.of(39 - row), expected, rtol=0.01, atol=1e-4 * expected.max())


@pytest.mark.parametrize("channels", [(), (3,)])
def test_light_is_the_sum_over_all_lights(channels: tuple[int, ...]) -> None:
    gains, given = run_gains(channels=channels), strengths()
    each = sum((gains.of(light).reshape(200, -1) * given[light] for light in range(41)), np.zeros((200, 3)))
    np.testing.assert_allclose(gains.irradiance(given), each, rtol=1e-5)


def test_points_can_be_taken_joined_and_replaced() -> None:
    one, other, given = run_gains(1), run_gains(2), strengths()
    whole = joined_gains([one, other])
    both = np.concatenate([one.irradiance(given), other.irradiance(given)])
    np.testing.assert_allclose(whole.irradiance(given), both, rtol=1e-12)
    rows = np.array([3, 250, 399])
    np.testing.assert_allclose(whole.take(rows).irradiance(given), both[rows], rtol=1e-12)
    changed = one.replaced(np.arange(50), other.take(np.arange(50)))
    assert isinstance(changed, RunGains)
    np.testing.assert_allclose(changed.irradiance(given)[:50], other.irradiance(given)[:50], rtol=1e-12)
    np.testing.assert_allclose(changed.irradiance(given)[50:], one.irradiance(given)[50:], rtol=1e-12)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("lit", [0.1, 0.4, 1.0])
def test_half_precision_is_right_to_a_thousandth(scale: float, lit: float) -> None:
    random = np.random.default_rng(3)
    gain = scale * random.uniform(1e-3, 1.0, 1000) * (random.uniform(0.0, 1.0, 1000) < lit)
    compact, exact = CompactGains(1000), LightGains(1000)
    for gains in (compact, exact):
        gains.put(5, gain)
    np.testing.assert_allclose(compact.of(5), gain, rtol=1e-3)
    given = np.zeros((6, 3))
    given[5] = (1.0, 2.0, 3.0)
    np.testing.assert_allclose(compact.irradiance(given), exact.irradiance(given), rtol=1e-3)
    assert compact.nbytes < 0.76 * exact.nbytes
    taken = compact.take(np.arange(100))
    np.testing.assert_allclose(taken.of(5), gain[:100], rtol=2e-3)
