"""Runs of gather rays: a point is the mean of its runs, and takes more where coarser points see noise."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.points import GatherPoints
from radiosity_addon.lightmap.texels import TexelGeometry, rasterize
from radiosity_addon.lightmap.transport import ray_runs
from radiosity_addon.lightmap.transport.ray_runs import (
    EVEN,
    MOST_RUNS,
    RUNS,
    any_of_runs,
    mean_over_runs,
    noise_weights,
    number_of_points,
    over_runs,
    runs_of,
    runs_with,
    variance_of,
)
from radiosity_addon.numerics import run_numbers, stratified_square
from radiosity_addon.rays import EmbreeCaster
from tests.rooms import gray_scene, rectangle

RANDOM = np.random.default_rng(5)
COUNTS = np.array([1, 2, 7, 3, 16, 1])


@pytest.mark.parametrize("tile", [1, 4, 1000])
def test_a_point_stands_for_the_mean_of_its_runs(tile: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many rows are looked at together: points are not cut."""
    monkeypatch.setattr(ray_runs, "TILE", tile)
    run, values = run_numbers(COUNTS).astype(np.int16), RANDOM.random((COUNTS.sum(), 3))
    parts = np.split(values, np.cumsum(COUNTS)[:-1])
    assert number_of_points(run) == len(COUNTS)
    np.testing.assert_allclose(mean_over_runs(values, run), [part.mean(axis=0) for part in parts], rtol=1e-12)
    marked = values[:, 0] > 0.8
    assert any_of_runs(marked, run).tolist() == [bool((part[:, 0] > 0.8).any()) for part in parts]
    np.testing.assert_array_equal(over_runs(np.arange(len(COUNTS)), run), np.repeat(np.arange(6), COUNTS))


@pytest.mark.parametrize("count", [2, 3, 4, 5, 16])
def test_a_sample_of_the_noise_has_the_variance_of_the_mean(count: int) -> None:
    """Of independent rows: what the mean is off has a variance of 1 / count, and so has the sample."""
    run = np.tile(np.arange(count), 2)
    assert (runs_with(run) == count).all()
    weights = noise_weights(run, runs_with(run))
    sample = weights[:count] / count
    assert abs(sample.sum()) < 1e-6
    assert (sample**2).sum() == pytest.approx(1.0 / count)
    np.testing.assert_array_equal(weights[:count], weights[count:])


def test_runs_are_counted_point_by_point() -> None:
    assert runs_with(np.array([0, 0, 1, 0])).tolist() == [1, 2, 2, 1]


def test_runs_go_on_where_the_last_ended() -> None:
    keys = np.array([3, 3, 70_000, 3])
    first = 24 * np.array([0, 1, 5, 2])
    found = stratified_square(keys, 24, 7, first)
    np.testing.assert_array_equal(np.concatenate(found[[0, 1, 3]]), stratified_square(keys[:1], 72, 7)[0])
    np.testing.assert_array_equal(found[2], stratified_square(keys[2:3], 144, 7)[0, 120:])


def test_the_variance_of_what_rays_bring() -> None:
    table = RANDOM.random((50, 3))
    sources = RANDOM.integers(0, 50, (9000, 8))
    tints = RANDOM.random((9000, 8, 3)).astype(np.float16)
    expected = (table[sources] * tints).var(axis=1).sum(axis=1)
    np.testing.assert_allclose(variance_of(sources, tints, lambda rows: table[rows]), expected)


def coarse_points(side: int = 64) -> tuple[GatherPoints, TexelGeometry]:
    """Every fourth texel of a floor of 1 × 1 in both directions."""
    ground = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    scene = gray_scene(ground)
    uv = ground[..., :2].astype(np.float32)
    geometry = TexelGeometry(scene, uv, np.zeros(2, dtype=int), [rasterize(uv, side)], [np.arange(2)])
    caster = EmbreeCaster(scene.triangles)
    points = GatherPoints(geometry, caster, np.zeros(len(geometry), dtype=bool))
    chosen = np.flatnonzero((geometry.row % 4 == 0) & (geometry.column % 4 == 0)).astype(np.int32)
    points.add(4, chosen, np.ones(len(chosen)))
    return points, geometry


def test_rays_go_where_coarser_points_see_noise_and_are_no_more_in_all() -> None:
    points, geometry = coarse_points()
    noisy = geometry.position[points.texel, 0] < 0.25
    variance = np.where(noisy, 9.0, 1.0)
    chosen = np.setdiff1d(np.arange(len(geometry)), points.texel)
    runs = runs_of(points, variance, chosen)
    x = geometry.position[chosen, 0]
    # Noise of 3 and 1, of which a quarter of the texels has the first: a mean of 1.5.
    assert runs[x < 0.2].mean() == pytest.approx(RUNS * (EVEN + (1.0 - EVEN) * 3.0 / 1.5), rel=0.03)
    assert runs[x > 0.3].mean() == pytest.approx(RUNS * (EVEN + (1.0 - EVEN) * 1.0 / 1.5), rel=0.03)
    assert runs.mean() == pytest.approx(RUNS, rel=0.02)


def test_all_take_as_many_where_nothing_is_known_and_none_takes_too_many() -> None:
    points, geometry = coarse_points()
    chosen = np.setdiff1d(np.arange(len(geometry)), points.texel)
    assert (runs_of(points, np.zeros(len(points)), chosen) == RUNS).all()
    one = np.zeros(len(points))
    one[0] = 1.0
    runs = runs_of(points, one, chosen)
    assert runs.max() == MOST_RUNS
    assert runs.min() == 1
