"""Error against time: how long a program takes to an error, and how fast cost grows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np


@dataclass(frozen=True)
class Point:
    """A measured bake: time [s], relative error, and samples where those are what costs."""

    seconds: float
    error: float
    samples: int | None = None


@dataclass(frozen=True)
class Reading:
    """A time read off a curve.

    `kind` says how: "measured" (a bake that took no longer has that error already), "interpolated"
    between two bakes, or "extrapolated" by samples^(-1/2).
    """

    seconds: float
    kind: str


def frontier(points: Sequence[Point]) -> list[Point]:
    """Return the points that no quicker one beats, by time; all others are no reason to wait."""
    best: list[Point] = []
    for point in sorted(points, key=lambda p: (p.seconds, p.error)):
        if not best or point.error < best[-1].error:
            best.append(point)
    return best


def time_to_reach(points: Sequence[Point], error: float) -> Reading | None:
    """Return the time to an error by what was measured alone, None if no bake reaches it.

    Between two bakes log error is linear in log time. The quickest bake is the least that can be
    paid: where it is better than the target, its whole time counts.
    """
    best = frontier(points)
    if not best or best[-1].error > error:
        return None
    if best[0].error <= error:
        return Reading(best[0].seconds, "measured")
    for coarse, fine in pairwise(best):
        if fine.error <= error:
            if fine.error == error:
                return Reading(fine.seconds, "measured")
            share = np.log(coarse.error / error) / np.log(coarse.error / max(fine.error, 1e-12))
            seconds = coarse.seconds * (fine.seconds / coarse.seconds) ** share
            return Reading(float(seconds), "interpolated")
    raise AssertionError("the last point of the frontier reaches the error")


def time_of_sampling(points: Sequence[Point], error: float) -> Reading | None:
    """Return the time to an error of a program whose error falls with samples^(-1/2).

    As `time_to_reach`; beyond the bake of most samples, samples are multiplied until the error is
    reached, and time follows the line through the measured times.

    Raises
    ------
    ValueError
        If a point does not say its samples.
    """
    reading = time_to_reach(points, error)
    if reading is not None or not points:
        return reading
    if any(point.samples is None for point in points):
        raise ValueError("a point without its samples cannot be extrapolated")
    last = max(points, key=lambda p: p.samples or 0)
    samples = float(last.samples or 0)
    needed = samples * (last.error / error) ** 2
    return Reading(last.seconds + seconds_per_sample(points) * (needed - samples), "extrapolated")


def seconds_per_sample(points: Sequence[Point]) -> float:
    """Return the slope of time against samples; the two bakes of most samples show it best."""
    by_samples = sorted(points, key=lambda p: p.samples or 0)
    if len(by_samples) == 1:
        return by_samples[0].seconds / float(by_samples[0].samples or 1)
    few, many = by_samples[-2:]
    return max(many.seconds - few.seconds, 0.0) / float((many.samples or 0) - (few.samples or 0))


def ratio(theirs: Reading | None, ours: Reading | None) -> float | None:
    """Return how many times longer they take."""
    return None if theirs is None or ours is None else theirs.seconds / ours.seconds


def sampling_order(points: Sequence[Point]) -> float:
    """Return the exponent p of error ∝ samples^p; −1/2 without a bias."""
    return growth_exponent([p.samples or 0 for p in points], [p.error for p in points])


def growth_exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """Return p of cost ∝ size^p by least squares in the logarithms.

    Raises
    ------
    ValueError
        If there are fewer than two sizes, or not all numbers are positive.
    """
    x, y = np.asarray(sizes, dtype=float), np.asarray(costs, dtype=float)
    if len(np.unique(x)) < 2 or (x <= 0).any() or (y <= 0).any():
        raise ValueError("an exponent needs two different sizes, and positive sizes and costs")
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])
