"""What the progress bar says of the time left."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from radiosity_addon.base.progress import Expected
from radiosity_addon.base.time_left import RemainingTime, duration


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def told(course, total: float, step: float = 0.1) -> list[tuple[float, float]]:
    """Run a job of `total` seconds whose fraction done is course(share of the time); (time left, told)."""
    clock = Clock()
    remaining = RemainingTime(clock)
    pairs = []
    for tick in range(1, round(total / step) + 1):
        clock.now = 100.0 + tick * step
        said = remaining.update(min(course(tick * step / total), 1.0))
        if said is not None:
            pairs.append((total - tick * step, said))
    return pairs


def test_even_progress_is_predicted_exactly() -> None:
    pairs = told(lambda share: share, 60.0)
    assert len(pairs) > 500
    for left, said in pairs:
        assert said == pytest.approx(left, abs=1e-6)


def test_nothing_is_said_at_the_very_beginning() -> None:
    clock = Clock()
    remaining = RemainingTime(clock)
    clock.now += 0.5
    assert remaining.update(0.3) is None
    clock.now += 5.0
    assert remaining.update(0.001) is None
    assert remaining.update(0.1) is not None


def test_a_stage_that_stands_still_lets_the_clock_run_down_only_slowly() -> None:
    """Half of the work in a fifth of the time, then a long stretch without news: no jumps, never below 0."""
    pairs = told(
        lambda share: 2.5 * share if share < 0.2 else 0.5 if share < 0.6 else 1.25 * share - 0.25, 50.0
    )
    said = [value for _, value in pairs]
    assert min(said) >= 0.0
    # A jump of more than a second a tenth of a second would be seen.
    assert max(abs(after - before) for before, after in pairwise(said)) < 1.0
    assert said[-1] == 0.0


def test_wrong_weights_are_made_good_as_the_work_goes_on() -> None:
    """The first fifth takes half of the time: in the last quarter the estimate is within a third."""
    pairs = told(lambda share: 0.4 * share if share < 0.5 else 1.6 * share - 0.6, 100.0)
    for left, said in pairs:
        if 1.0 < left < 25.0:
            assert said == pytest.approx(left, rel=0.34, abs=1.0)


def by_stages(expected: list[float], took: list[float], step: float = 0.1) -> list[tuple[float, float]]:
    """Run stages of expected and of real seconds, each even; (time left, told)."""
    clock = Clock()
    remaining = RemainingTime(clock)
    ends, total, pairs = np.cumsum([0.0, *took]), sum(took), []
    clock.now -= 3.0  # the scene is read, of which nothing is expected
    for _ in range(3):
        clock.now += 1.0
        remaining.update(0.0)
    for tick in range(round(total / step)):
        clock.now = 100.0 + tick * step
        done = float(np.interp(tick * step, ends, np.cumsum([0.0, *expected])))
        said = remaining.update(done / sum(expected), Expected(done, sum(expected) - done))
        if said is not None:
            pairs.append((total - tick * step, said))
    return pairs


@pytest.mark.parametrize("slower", [0.5, 1.0, 2.0])
def test_a_machine_of_another_speed_is_known_after_a_tenth(slower: float) -> None:
    expected = [2.0, 3.0, 5.0, 45.0, 5.0]
    pairs = by_stages(expected, [slower * seconds for seconds in expected])
    total = slower * sum(expected)
    assert len(pairs) > 50 * total / 10
    for left, said in pairs:
        if 1.0 < left < 0.9 * total:
            assert left / 1.5 < said < 1.5 * left


def test_a_first_stage_that_takes_three_times_as_long_says_little_of_the_others() -> None:
    for left, said in by_stages([2.0, 3.0, 95.0], [6.0, 3.0, 95.0]):
        if 1.0 < left < 0.9 * 104.0:
            assert left / 1.5 < said < 1.5 * left


def test_what_comes_after_all_that_was_expected_lets_the_clock_run_down() -> None:
    clock = Clock()
    remaining = RemainingTime(clock)
    clock.now += 2.0
    for done in range(1, 9):
        clock.now += 1.0
        remaining.update(0.1 * done, Expected(float(done), 10.0 - done))
    before = remaining.update(0.8, Expected(8.0, 2.0))
    clock.now += 0.5
    assert before is not None
    assert remaining.update(0.85) == pytest.approx(before - 0.5)


@pytest.mark.parametrize(
    ("seconds", "said"),
    [
        (0.0, "0 s"),
        (0.2, "1 s"),
        (9.5, "10 s"),
        (11.0, "15 s"),
        (55.0, "55 s"),
        (56.0, "1 min"),
        (119.0, "2 min"),
        (121.0, "2 min 10 s"),
        (300.0, "5 min"),
        (301.0, "6 min"),
        (3550.0, "1 h"),
        (4000.0, "1 h 10 min"),
        (7200.0, "2 h"),
    ],
)
def test_durations_are_said_as_people_do(seconds: float, said: str) -> None:
    assert duration(seconds) == said
