"""Texels lit to an error asked for: the estimate, and the settings that follow an error."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.quality import LADDER, for_error
from radiosity_addon.base.errors import UsageError
from radiosity_addon.lightmap.lighting import accuracy
from radiosity_addon.lightmap.points.interpolation import Interpolation
from radiosity_addon.lightmap.transport.gather_links import GatherLinks
from radiosity_addon.lightmap.transport.gather_settings import GatherSettings
from radiosity_addon.lightmap.transport.sweeps import TexelLight, estimated_noise, relative_error
from radiosity_addon.options.bake_settings import BakeSettings


def links_of(sources: np.ndarray) -> GatherLinks:
    """Every texel is a gather point of its own."""
    count = len(sources)
    own = np.arange(count)
    return GatherLinks(sources.astype(np.int32), Interpolation(own, own, np.ones(count)))


def estimated_error(links: GatherLinks, table: np.ndarray, irradiance: np.ndarray) -> float:
    return relative_error(estimated_noise(links, table), irradiance)


@pytest.mark.parametrize("rays", [16, 64, 256])
def test_the_estimate_is_the_noise_of_random_rays(rays: int) -> None:
    """Hits drawn at random from a known table: the true error of each mean is known."""
    rng = np.random.default_rng(7)
    table = rng.gamma(0.5, 2.0, (5000, 1)).repeat(3, axis=1).astype(np.float32)
    sources = rng.integers(0, len(table), (4000, rays))
    found = table[sources].mean(axis=1)
    true = np.sqrt(((found - table.mean(axis=0)) ** 2).mean()) / table.mean()
    estimate = estimated_error(links_of(sources), table, found.astype(np.float64))
    assert estimate == pytest.approx(true, rel=0.05)


def test_rays_that_agree_have_no_error() -> None:
    table = np.ones((10, 3), dtype=np.float32)
    sources = np.random.default_rng(1).integers(0, 10, (50, 32))
    assert estimated_error(links_of(sources), table, np.ones((50, 3))) == pytest.approx(0.0, abs=1e-7)


def test_darkness_has_no_error() -> None:
    assert estimated_error(links_of(np.zeros((3, 4))), np.zeros((1, 3), np.float32), np.zeros((3, 3))) == 0.0


@pytest.mark.parametrize("rung", range(len(LADDER)))
def test_a_rung_of_the_ladder_is_what_reaches_its_error(rung: int) -> None:
    error, quality = LADDER[rung]
    found = for_error(error)
    assert found.gather.rays == quality.gather.rays
    assert found.gather.support == pytest.approx(quality.gather.support)
    assert found.gather.tolerance == pytest.approx(quality.gather.tolerance)
    assert found.solver.error == pytest.approx(quality.solver.error)
    assert found.solver.shadow_rays == quality.solver.shadow_rays


def test_smaller_errors_take_no_fewer_rays() -> None:
    found = [for_error(error) for error in np.geomspace(0.2, 0.002, 30)]
    rays = [quality.gather.rays for quality in found]
    assert rays == sorted(rays)
    assert rays[-1] > 4 * rays[0]
    errors = [quality.solver.error for quality in found]
    assert errors == sorted(errors, reverse=True)


@pytest.mark.parametrize("power", [0.5, 0.65])
@pytest.mark.parametrize("times", [0.3, 1.0, 3.0, 20.0])
def test_it_takes_more_rays_until_the_error_is_reached(
    monkeypatch: pytest.MonkeyPatch, power: float, times: float
) -> None:
    """Errors that fall like rays^-1/2, or faster, but are `times` those that the settings are for."""
    error, rays = 0.02, 64
    taken: list[float] = []

    def light(_scene, _local, _geometry, settings, so_far, more_rays, progress):  # type: ignore[no-untyped-def]
        taken.append(settings.rays)
        while True:
            reached = times * error * (rays / taken[-1]) ** power
            factor = more_rays(reached)
            if factor <= 1.0:
                return TexelLight(np.ones((1, 3)), np.ones((1, 3)), reached)
            taken.append(taken[-1] * factor)

    monkeypatch.setattr(accuracy, "light_texels", light)
    result = accuracy.light_within(None, None, None, GatherSettings(rays=rays), error, 2048)
    assert taken == sorted(taken)
    assert taken[-1] <= 2048
    if times * (rays / 2048) ** power > 1.0:
        assert taken[-1] == pytest.approx(2048)  # it cannot be had
    elif len(taken) > 1:
        assert error / 1.3 <= result.error <= error
    else:
        assert result.error <= error


@pytest.mark.parametrize("error", [0.0, 0.001, 0.3, float("nan")])
def test_impossible_errors_are_refused(error: float) -> None:
    with pytest.raises(UsageError, match="between"):
        BakeSettings(relative_error=error)


def test_an_error_picture_has_no_error_to_reach() -> None:
    with pytest.raises(UsageError, match="residual"):
        BakeSettings(relative_error=0.02, quantity="residual")
