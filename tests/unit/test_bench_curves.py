"""What the benchmarks conclude from measured times and errors."""

from __future__ import annotations

import numpy as np
import pytest

from bench.curves import (
    Point,
    Reading,
    frontier,
    growth_exponent,
    ratio,
    sampling_order,
    seconds_per_sample,
    time_of_sampling,
    time_to_reach,
)
from bench.error_measure import error_figures, relative_rmse
from bench.views import samples_as_long

SAMPLING = [Point(0.5 + 0.01 * n, 1.6 / np.sqrt(n), n) for n in (16, 64, 256)]
"""Half a second and 10 ms a sample; errors of 40 %, 20 % and 10 %."""


def test_a_power_law_is_interpolated_exactly() -> None:
    law = [Point(seconds, 0.3 * seconds**-0.7) for seconds in (1.0, 2.0, 16.0)]
    for seconds in (1.3, 2.0, 7.0, 15.9):
        reading = time_to_reach(law, 0.3 * seconds**-0.7)
        assert reading is not None
        assert reading.seconds == pytest.approx(seconds, rel=1e-12)
    middle = time_to_reach(law, 0.3 * 7.0**-0.7)
    assert middle is not None
    assert middle.kind == "interpolated"


def test_a_measured_error_has_its_measured_time() -> None:
    for point in SAMPLING:
        assert time_to_reach(SAMPLING, point.error) == Reading(point.seconds, "measured")


def test_nothing_is_cheaper_than_the_quickest_bake() -> None:
    assert time_to_reach(SAMPLING, 0.9) == Reading(SAMPLING[0].seconds, "measured")


def test_what_no_bake_reaches_has_no_time() -> None:
    assert time_to_reach(SAMPLING, 0.09) is None
    assert time_to_reach([], 0.09) is None
    assert time_of_sampling([], 0.09) is None


def test_slower_and_worse_bakes_do_not_matter() -> None:
    law = [Point(1.0, 0.04), Point(4.0, 0.02)]
    spoilt = [*law, Point(1.5, 0.05), Point(9.0, 0.02), Point(5.0, 0.03)]
    assert frontier(spoilt) == law
    assert time_to_reach(spoilt, 0.03) == time_to_reach(law, 0.03)


def test_sampling_is_extrapolated_by_the_square_root() -> None:
    """An error of 2 % takes 1.6² / 0.02² = 6400 samples: half a second and 64."""
    reading = time_of_sampling(SAMPLING, 0.02)
    assert reading is not None
    assert reading.kind == "extrapolated"
    assert reading.seconds == pytest.approx(64.5)
    assert time_of_sampling(SAMPLING, 0.15) == time_to_reach(SAMPLING, 0.15)


def test_a_single_bake_is_extrapolated_without_fixed_costs() -> None:
    reading = time_of_sampling([Point(2.0, 0.1, 100)], 0.05)
    assert reading is not None
    assert reading.seconds == pytest.approx(8.0)


def test_extrapolation_starts_from_the_most_samples_not_from_the_best_luck() -> None:
    lucky = [*SAMPLING[:2], Point(3.06, 0.25, 256)]
    reading = time_of_sampling(lucky, 0.125)
    assert reading is not None
    assert reading.seconds == pytest.approx(3.06 + 0.01 * 3 * 256)


def test_points_without_samples_cannot_be_extrapolated() -> None:
    with pytest.raises(ValueError, match="samples"):
        time_of_sampling([Point(1.0, 0.1), Point(2.0, 0.05)], 0.01)


def test_time_a_sample_and_order() -> None:
    assert seconds_per_sample(SAMPLING) == pytest.approx(0.01)
    assert sampling_order(SAMPLING) == pytest.approx(-0.5)


def test_ratios() -> None:
    assert ratio(Reading(60.0, "extrapolated"), Reading(2.0, "measured")) == 30.0
    assert ratio(None, Reading(2.0, "measured")) is None
    assert ratio(Reading(60.0, "measured"), None) is None


@pytest.mark.parametrize("exponent", [0.9, 1.0, 1.15, 2.0])
def test_growth_of_a_power_law(exponent: float) -> None:
    sizes = [1e4, 1e5, 1e6]
    assert growth_exponent(sizes, [3e-5 * n**exponent for n in sizes]) == pytest.approx(exponent)


@pytest.mark.parametrize(
    ("sizes", "costs"), [([5, 5], [1, 2]), ([5], [1]), ([5, 6], [0, 1]), ([0, 6], [1, 1])]
)
def test_growth_needs_two_sizes_and_positive_numbers(sizes: list, costs: list) -> None:
    with pytest.raises(ValueError, match="exponent"):
        growth_exponent(sizes, costs)


def noisy(true: np.ndarray, noise: float, seed: int) -> np.ndarray:
    return true + noise * np.random.default_rng(seed).standard_normal(true.shape)


def test_the_noise_of_references_does_not_count() -> None:
    """An error of 3 % is told through references with a noise of 20 %; so is that there is none."""
    true = np.full((200_000, 3), 2.0)
    first, second = noisy(true, 0.4, 1), noisy(true, 0.4, 2)
    assert relative_rmse(noisy(true, 0.06, 3), first, second) == pytest.approx(0.03, rel=0.05)
    assert relative_rmse(true, first, second) < 0.01


def test_no_error_is_claimed_below_what_the_references_can_tell() -> None:
    """Of 1000 texels with a noise of 20 %, products are known to 0.2² / √1000 / √3."""
    true = np.full((1000, 3), 2.0)
    for seed in range(0, 20, 2):
        figures = error_figures(true, noisy(true, 0.4, seed), noisy(true, 0.4, seed + 1))
        assert figures["error"] >= 0.9 * np.sqrt(0.04 / np.sqrt(3000))
        assert figures["error"] >= figures["relative_rmse"]


def test_figures_of_an_error() -> None:
    true = np.full((50_000, 3), 2.0)
    figures = error_figures(1.05 * true, noisy(true, 0.02, 1), noisy(true, 0.02, 2))
    assert figures["error"] == pytest.approx(0.05, abs=4 * figures["uncertainty"])
    assert figures["mean_ratio"] == pytest.approx(1.05, abs=1e-3)
    assert 0.05 < figures["percentile_99"] < 0.1
    assert 0 < figures["uncertainty"] < 1e-3


def test_the_uncertainty_is_the_spread_over_references() -> None:
    true = np.full((2_000, 3), 2.0)
    bake = noisy(true, 0.2, 0)
    found = [error_figures(bake, noisy(true, 0.3, 2 * n + 1), noisy(true, 0.3, 2 * n + 2)) for n in range(60)]
    spread = np.std([figures["error"] for figures in found])
    # References' noise is part of it; that channels err together is allowed for, and here they do not.
    assert 0.5 * spread < np.mean([figures["uncertainty"] for figures in found]) < 2.5 * spread


def test_samples_that_take_as_long_are_on_the_line_of_the_measured_ones() -> None:
    oidn = [{"samples": n, "cpu_seconds": 3.0 + 0.5 * n} for n in (16, 64, 256)]
    ours = [{"label": label, "cpu_seconds": seconds} for label, seconds in (("draft", 50.0), ("sketch", 2.0))]
    assert samples_as_long({"ours": ours, "cycles_oidn": oidn}, "draft") == 94
    assert samples_as_long({"ours": ours, "cycles_oidn": oidn}, "sketch") == 1  # no picture has none
