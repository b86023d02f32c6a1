"""Least, mean and most light, and which texels count."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.images.irradiance_statistics import light_statistics, lit_texels
from radiosity_addon.lightmap.texels.states import DIVIDED, ENCLOSED, OCCLUDED, TOUCHED
from radiosity_addon.numerics.radiometry import luminous


def test_the_mean_is_by_area_and_the_ends_are_not() -> None:
    found = light_statistics(np.array([1.0, 4.0, 100.0]), np.array([3.0, 1.0, 0.0]))
    assert found is not None
    assert (found.minimum, found.mean, found.maximum) == (1.0, 1.75, 4.0)
    assert found.uniformity == pytest.approx(4 / 7)


def test_without_area_there_is_nothing_and_the_dark_is_not_even() -> None:
    assert light_statistics(np.ones(2), np.zeros(2)) is None
    dark = light_statistics(np.zeros(2), np.ones(2))
    assert dark is not None
    assert dark.uniformity is None


def test_texels_of_two_lights_or_of_none_do_not_count() -> None:
    state = np.array([0, DIVIDED, OCCLUDED, TOUCHED, ENCLOSED], dtype=np.uint8)
    assert lit_texels(state).tolist() == [True, False, False, True, False]
    assert lit_texels(state[[1, 2, 4]]).all()


def test_a_watt_of_white_makes_the_lumens_of_the_efficacy_and_green_most_of_them() -> None:
    np.testing.assert_allclose(luminous(np.array([1.0, 1.0, 1.0]), 683.0), 683.0)
    red, green, blue = luminous(np.eye(3), 100.0)
    assert (red, green, blue) == pytest.approx((21.26, 71.52, 7.22))
