"""Noise shared between texels: no light is lost, edges stay, and walls keep texels apart."""

from __future__ import annotations

import numpy as np

from radiosity_addon.lightmap.points import Smoothing, alike_neighbors, choose_smoothing
from radiosity_addon.lightmap.texels import TexelGeometry, rasterize
from radiosity_addon.rays import EmbreeCaster
from tests.rooms import gray_scene, rectangle

SIDE = 48


def floor(*others: np.ndarray) -> tuple[TexelGeometry, EmbreeCaster]:
    """Return the texels of a floor of 1 × 1 that fills its page, and rays that meet other shapes as well."""
    ground = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    scene = gray_scene(np.concatenate([ground, *others]))
    uv = np.zeros((len(scene), 3, 2), dtype=np.float32)
    uv[:2] = ground[..., :2]
    page = np.where(np.arange(len(scene)) < 2, 0, -1)
    texels = rasterize(uv[:2], SIDE)
    return TexelGeometry(scene, uv, page, [texels], [np.arange(2)]), EmbreeCaster(scene.triangles)


def neighbors(geometry: TexelGeometry, caster: EmbreeCaster) -> np.ndarray:
    return alike_neighbors(geometry, caster, np.zeros(len(geometry), dtype=bool))


def test_no_light_is_lost_and_even_light_stays() -> None:
    geometry, caster = floor()
    alike = neighbors(geometry, caster)
    smoothing = Smoothing(alike, np.full(len(geometry), 16, dtype=np.uint8))
    values = np.random.default_rng(1).random((len(geometry), 3)).astype(np.float32)
    smooth = smoothing(geometry, values)
    np.testing.assert_allclose(smooth.sum(axis=0), values.sum(axis=0), rtol=1e-5)
    assert smooth.std() < 0.15 * values.std()
    np.testing.assert_allclose(smoothing(geometry, np.ones_like(values)), 1.0, rtol=1e-6)


def test_neighbors_are_mutual() -> None:
    """Also where texels of two sizes meet."""
    ground = np.concatenate(
        [rectangle((0, 0, 0), (0.5, 0, 0), (0, 1, 0)), rectangle((0.5, 0, 0), (0.125, 0, 0), (0, 1, 0))]
    )
    scene = gray_scene(ground)
    uv = ground[..., :2].astype(np.float32)
    uv[2:, :, 0] = 0.5 + 4.0 * (uv[2:, :, 0] - 0.5)
    geometry = TexelGeometry(scene, uv, np.zeros(4, dtype=int), [rasterize(uv, SIDE)], [np.arange(4)])
    alike = neighbors(geometry, EmbreeCaster(scene.triangles))
    (index,) = geometry.index
    steps = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
    pairs = 0
    for bit, (i, j) in enumerate(steps):
        for row, column in zip(geometry.row, geometry.column, strict=True):
            if alike[index[row, column]] >> bit & 1:
                assert alike[index[row + i, column + j]] >> (7 - bit) & 1
                pairs += 1
    assert pairs > 4 * len(geometry)


def test_noise_is_shared_where_light_is_even_and_an_edge_stays() -> None:
    geometry, caster = floor()
    alike = neighbors(geometry, caster)
    random = np.random.default_rng(2)
    x = geometry.position[:, :1]
    truth = np.where(x < 0.5, 1.0, 3.0) * np.ones(3)
    sigma = 0.1
    noise, other = random.normal(0.0, sigma, (2, *truth.shape))
    values = truth + noise
    # In two parts: what counts is their sum.
    smoothing, smoothed = choose_smoothing(geometry, alike, [0.25 * values, 0.75 * values], other)
    error = smoothing(geometry, values.astype(np.float32)) - truth
    np.testing.assert_allclose(smoothed[:, :3] + smoothed[:, 3:], error + truth, rtol=1e-5)
    even = np.abs(x[:, 0] - 0.5) > 0.25
    assert np.sqrt((error[even] ** 2).mean()) < 0.35 * sigma
    # Next to the edge the error may not be more than the noise was.
    assert np.sqrt((error[~even] ** 2).mean()) < sigma
    assert (smoothing.passes[np.abs(x[:, 0] - 0.5) < 1.0 / SIDE] == 0).all()


def test_what_has_no_noise_is_not_touched() -> None:
    geometry, caster = floor()
    alike = neighbors(geometry, caster)
    values = np.sin(7.0 * geometry.position).astype(np.float32)
    smoothing, _ = choose_smoothing(geometry, alike, [values], np.zeros_like(values))
    error = np.abs(smoothing(geometry, values) - values)
    assert error.max() < 1e-6


def test_a_wall_between_texels_keeps_them_apart() -> None:
    """It stands on a line between two columns of texels, so that it cuts none of them."""
    wall = rectangle((0.5, -1, -1), (0, 3, 0), (0, 0, 3))
    geometry, caster = floor(wall)
    smoothing = Smoothing(neighbors(geometry, caster), np.full(len(geometry), 16, dtype=np.uint8))
    left = geometry.position[:, :1] < 0.5
    smooth = smoothing(geometry, (left * np.ones(3)).astype(np.float32))
    assert (smooth[~left[:, 0]] == 0.0).all()
    np.testing.assert_allclose(smooth[left[:, 0]], 1.0, rtol=1e-6)


def test_divided_texels_share_with_each_other_only() -> None:
    geometry, caster = floor()
    alone = np.asarray(geometry.column == 10)
    alike = alike_neighbors(geometry, caster, alone)
    smoothing = Smoothing(alike, np.full(len(geometry), 16, dtype=np.uint8))
    values = np.random.default_rng(4).random((len(geometry), 3)).astype(np.float32)
    values[~alone] += 5.0
    smooth = smoothing(geometry, values)
    for kind in (alone, ~alone):
        np.testing.assert_allclose(smooth[kind].sum(axis=0), values[kind].sum(axis=0), rtol=1e-5)
        assert smooth[kind].std() < 0.6 * values[kind].std()
    assert smooth[alone].max() < 1.0
    # What lies on either side of them is apart.
    left = np.asarray(geometry.column < 10)
    np.testing.assert_allclose(smooth[left].sum(axis=0), values[left].sum(axis=0), rtol=1e-5)


def test_threads_and_operators_are_the_same() -> None:
    geometry, caster = floor()
    alike = neighbors(geometry, caster)
    random = np.random.default_rng(3)
    values, noise = random.random((2, len(geometry), 3)).astype(np.float32)
    (one, smoothed), (two, _) = (
        choose_smoothing(geometry, alike, [values], noise, threads) for threads in (1, 2)
    )
    np.testing.assert_array_equal(one.passes, two.passes)
    np.testing.assert_array_equal(one(geometry, values), smoothed)
    both = one(geometry, values + noise)
    np.testing.assert_allclose(both, one(geometry, values) + one(geometry, noise), rtol=1e-4, atol=1e-5)
