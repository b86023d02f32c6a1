"""Round numbers along an axis, and how they are written."""

from __future__ import annotations

import pytest

from radiosity_addon.base import linear_ticks, tick_label


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (0, 1, (0, 0.2, 0.4, 0.6, 0.8, 1)),
        (0, 1.04 * 23, (0, 5, 10, 15, 20)),
        (0, 6.9, (0, 1, 2, 3, 4, 5, 6)),
        (0, 7.1, (0, 2, 4, 6)),
        (-1, 1, (-1, -0.5, 0, 0.5, 1)),
        (0, 3e-5, (0, 5e-6, 1e-5, 1.5e-5, 2e-5, 2.5e-5, 3e-5)),
        (0, 41600, (0, 10000, 20000, 30000, 40000)),
    ],
)
def test_linear_ticks_are_round_and_few(low: float, high: float, ticks: tuple[float, ...]) -> None:
    assert linear_ticks(low, high) == pytest.approx(ticks)


def test_linear_ticks_reach_the_end_of_any_axis() -> None:
    for exponent in range(-9, 10):
        for mantissa in (1.0, 1.3, 1.9999, 2.5, 3.7, 5.0, 6.8, 7.0, 9.99):
            high = mantissa * 10.0**exponent
            ticks = linear_ticks(0.0, high)
            assert 3 <= len(ticks) <= 8
            assert 0 == ticks[0] < ticks[-1] <= high * (1 + 1e-9)
            assert high - ticks[-1] <= (ticks[1] - ticks[0]) * (1 + 1e-9)


@pytest.mark.parametrize(
    ("value", "label"),
    [
        (0, "0"),
        (0.25, "0.25"),
        (20, "20"),
        (1000, "1k"),
        (1500, "1.5k"),
        (200_000, "200k"),
        (5e6, "5M"),
        (1e9, "1G"),
        (0.01, "0.01"),
        (1e-3, "1e-3"),
        (5e-12, "5e-12"),
        (1.5e-5, "1.5e-5"),
    ],
)
def test_labels_are_short(value: float, label: str) -> None:
    assert tick_label(value) == label
