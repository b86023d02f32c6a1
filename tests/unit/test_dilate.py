"""Dilation: everything gets filled, from what is near, and charts do not mix."""

import numpy as np
import pytest

from radiosity_addon.lightmap.images.dilate import dilate


def page(seed: int, height: int, width: int, share: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    coverage = rng.uniform(size=(height, width)) < share
    pixels = rng.uniform(1, 2, (height, width, 3)).astype(np.float32)
    pixels[~coverage] = np.nan  # what was never baked must never be read
    return pixels, coverage


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (5, 3), (16, 16), (33, 20)])
@pytest.mark.parametrize("rings", [0, 1, 8])
def test_everything_is_filled_within_the_range_of_the_covered(shape, rings):
    pixels, coverage = page(1, *shape, share=0.1)
    coverage[0, 0], pixels[0, 0] = True, 1.5
    filled = dilate(pixels, coverage, rings)
    assert np.isfinite(filled).all()
    np.testing.assert_array_equal(filled[coverage], pixels[coverage])
    assert filled.min() >= pixels[coverage].min()
    assert filled.max() <= pixels[coverage].max()


def test_an_empty_page_is_black():
    filled = dilate(np.full((4, 4, 3), np.nan, np.float32), np.zeros((4, 4), bool))
    assert (filled == 0).all()


def test_the_input_is_left_alone_and_the_result_repeats():
    pixels, coverage = page(2, 12, 12, 0.2)
    before, mask = pixels.copy(), coverage.copy()
    first = dilate(pixels, coverage)
    np.testing.assert_array_equal(pixels, before)
    np.testing.assert_array_equal(coverage, mask)
    assert first.tobytes() == dilate(pixels, coverage).tobytes()


def test_a_texel_between_two_takes_their_mean():
    pixels = np.array([[[1.0], [0.0], [3.0]]], dtype=np.float32)
    filled = dilate(pixels, np.array([[True, False, True]]))
    assert filled[0, 1, 0] == 2.0


def test_no_direction_is_preferred():
    pixels, coverage = page(3, 15, 15, 0.15)
    filled = dilate(pixels, coverage, 20)
    for turn in (1, 2, 3):
        turned = dilate(np.rot90(pixels, turn).copy(), np.rot90(coverage, turn).copy(), 20)
        np.testing.assert_allclose(turned, np.rot90(filled, turn), rtol=1e-6)
    np.testing.assert_allclose(
        dilate(pixels[::-1].copy(), coverage[::-1].copy(), 20), filled[::-1], rtol=1e-6
    )


def test_charts_two_texels_apart_do_not_mix_next_to_their_border():
    pixels = np.zeros((6, 10, 1), dtype=np.float32)
    coverage = np.zeros((6, 10), dtype=bool)
    coverage[:, :4], coverage[:, 6:] = True, True
    pixels[:, :4], pixels[:, 6:] = 1, 5
    filled = dilate(pixels, coverage)
    assert (filled[:, 4] == 1).all()
    assert (filled[:, 5] == 5).all()
