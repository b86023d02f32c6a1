"""Bilinear look-ups: they keep linear images, and give texels at their middles."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics import texels_around


def looked_up(image: np.ndarray, place: np.ndarray) -> np.ndarray:
    texel, share = texels_around(place, image.shape[1], image.shape[0])
    right, up = share[..., 0], share[..., 1]
    weights = np.stack([(1 - right) * (1 - up), right * (1 - up), (1 - right) * up, right * up], axis=-1)
    assert (weights >= 0).all()
    return np.asarray((image.ravel()[texel] * weights).sum(axis=-1))


@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (5, 1), (2, 2), (7, 4)])
def test_linear_images_are_kept_between_the_middles_of_the_rim(shape: tuple[int, int]) -> None:
    height, width = shape
    rows, columns = np.indices(shape)
    image = 3.0 * columns - 2.0 * rows + 1.0
    place = np.random.default_rng(1).uniform(-0.5, 1.5, (500, 3, 2)) * (width, height)
    between = np.clip(place - 0.5, 0.0, (width - 1, height - 1))
    expected = 3.0 * between[..., 0] - 2.0 * between[..., 1] + 1.0
    np.testing.assert_allclose(looked_up(image, place), expected, atol=1e-12)


@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (5, 1), (7, 4)])
def test_middles_give_their_texels(shape: tuple[int, int]) -> None:
    image = np.random.default_rng(2).random(shape)
    rows, columns = np.indices(shape)
    np.testing.assert_array_equal(looked_up(image, np.stack([columns, rows], axis=-1) + 0.5), image)


def test_images_of_different_size_are_read_as_if_alone() -> None:
    place = np.random.default_rng(3).uniform(0, 9, (200, 2))
    sizes = np.random.default_rng(4).integers(1, 9, (200, 2))
    texel, share = texels_around(place, sizes[:, 0], sizes[:, 1])
    for row in range(200):
        alone = texels_around(place[row : row + 1], *sizes[row].tolist())
        np.testing.assert_array_equal(texel[row], alone[0][0])
        np.testing.assert_array_equal(share[row], alone[1][0])
