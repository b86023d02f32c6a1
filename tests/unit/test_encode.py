"""Quantities and 16-bit scaling."""

import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError, UsageError
from radiosity_addon.lightmap.images.encode import encode_png16, png16_scale, presentable, to_quantity
from radiosity_addon.lightmap.images.page import LightmapPage

IRRADIANCE = np.array([[np.pi, 2.0, 0.0]])
REFLECTANCE = np.array([[0.5, 0.25, 0.75]])
EMISSION = np.array([[1.0, 0.0, 3.0]])


@pytest.mark.parametrize(
    ("quantity", "expected"),
    [
        ("irradiance_over_pi", (1.0, 2 / np.pi, 0.0)),
        ("irradiance", (np.pi, 2.0, 0.0)),
        ("radiosity", (1 + np.pi / 2, 0.5, 3.0)),
    ],
)
def test_quantities(quantity, expected):
    np.testing.assert_allclose(
        to_quantity(IRRADIANCE, REFLECTANCE, EMISSION, quantity)[0], expected, rtol=1e-15
    )


def test_an_unknown_quantity_is_named():
    with pytest.raises(UsageError, match="luminance"):
        to_quantity(IRRADIANCE, REFLECTANCE, EMISSION, "luminance")


@pytest.mark.parametrize(("signed", "expected"), [(False, [0.0, 2.0]), (True, [-1.0, 2.0])])
def test_only_error_pictures_keep_values_below_0(signed, expected):
    pixels = np.repeat(np.array([[[-1.0], [2.0]]], np.float32), 3, axis=2)
    (page,) = presentable([LightmapPage(pixels, np.ones((1, 2), bool))], signed)
    np.testing.assert_array_equal(page.pixels[0, :, 0], expected)


def test_one_scale_for_all_pages_brings_them_back_within_half_a_step():
    rng = np.random.default_rng(0)
    pages = [rng.uniform(0, top, (8, 8, 3)).astype(np.float32) for top in (0.3, 40.0)]
    scale = png16_scale(*pages)
    assert scale == max(page.max() for page in pages)
    for page in pages:
        stored = encode_png16(page, scale)
        assert stored.min() >= 0
        assert stored.max() <= 1
        steps = stored.astype(float) * 65535
        np.testing.assert_allclose(steps, np.rint(steps), atol=4e-3)
        np.testing.assert_allclose(stored.astype(float) * scale, page, atol=scale / 131070 * 1.001)


def test_the_brightest_texel_is_one():
    page = np.array([[[0.1, 0.2, 7.3]]], dtype=np.float32)
    assert encode_png16(page, png16_scale(page))[0, 0, 2] == 1.0


def test_black_pages_have_scale_one():
    black = np.zeros((2, 2, 3), dtype=np.float32)
    assert png16_scale(black, black) == 1.0
    assert (encode_png16(black, 1.0) == 0).all()


def test_values_that_are_not_finite_are_refused():
    with pytest.raises(BakeError, match="finite"):
        png16_scale(np.array([[[np.inf, 0, 0]]], dtype=np.float32))
