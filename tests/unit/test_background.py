"""Work in a thread behaves as if it were not in one, and can be stopped."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Generator

import pytest

from radiosity_addon.base.background import SWITCH_INTERVAL, in_thread
from radiosity_addon.base.progress import Progress


def finish(steps: Generator) -> tuple[list[float], object]:
    """The fractions that come through, and what is returned."""
    fractions = []
    while True:
        try:
            status = next(steps)
        except StopIteration as end:
            return fractions, end.value
        if status is not None:
            fractions.append(status.fraction)


@pytest.mark.parametrize("in_window", [True, False])
def test_what_it_reports_and_returns_comes_through(in_window: bool) -> None:
    threads = set()

    def work(progress: Progress) -> str:
        for number in range(5):
            threads.add(threading.current_thread())
            progress.at(number / 4)
        return "result"

    assert finish(in_thread(work, in_window)) == ([0, 0.25, 0.5, 0.75, 1], "result")
    assert len(threads) == 1
    assert threading.main_thread() not in threads


def test_what_it_raises_comes_through() -> None:
    def work(progress: Progress) -> None:
        progress.at(0.5)
        raise ValueError("the reason")

    with pytest.raises(ValueError, match="the reason"):
        finish(in_thread(work))


def test_a_long_step_does_not_hold_the_caller() -> None:
    go_on = threading.Event()

    def work(progress: Progress) -> None:
        go_on.wait(60)
        progress.at(1.0)

    steps = in_thread(work)
    assert [next(steps) for _ in range(3)] == [None, None, None]
    go_on.set()
    assert finish(steps) == ([1.0], None)


def test_outside_a_window_only_news_come() -> None:
    def work(progress: Progress) -> None:
        time.sleep(0.05)
        progress.at(1.0)

    assert [status.fraction for status in in_thread(work, in_window=False) if status] == [1.0]
    assert None not in list(in_thread(work, in_window=False))


def test_the_work_goes_on_while_the_caller_does_something_else() -> None:
    arrived = threading.Event()

    def work(progress: Progress) -> None:
        for number in range(3):
            progress.at(number / 2)
        arrived.set()

    steps = in_thread(work)
    first = next(steps)
    assert arrived.wait(60)
    fractions, _ = finish(steps)
    assert [*([] if first is None else [first.fraction]), *fractions] == [0, 0.5, 1]


@pytest.mark.parametrize("in_window", [True, False])
def test_closed_it_cancels_the_work_at_its_next_progress(in_window: bool) -> None:
    """In a window closing does not wait for that."""
    go_on, cleaned_up, goes_on = threading.Event(), threading.Event(), []

    def work(progress: Progress) -> None:
        try:
            progress.at(0.0)
            go_on.wait(60)
            progress.at(0.5)
            goes_on.append(True)
        finally:
            cleaned_up.set()

    steps = in_thread(work, in_window)
    while next(steps) is None:
        pass
    if in_window:
        steps.close()
        assert not cleaned_up.is_set()
        go_on.set()
        assert cleaned_up.wait(60)
    else:
        threading.Timer(0.05, go_on.set).start()
        steps.close()
        assert cleaned_up.is_set()
    assert goes_on == []


def test_turns_are_short_while_it_runs_and_as_before_afterwards() -> None:
    """A window that is drawn asks for Python's lock dozens of times; each takes a turn at most."""
    before, during = sys.getswitchinterval(), []

    def work(progress: Progress) -> None:
        during.append(sys.getswitchinterval())
        progress.at(1.0)

    finish(in_thread(work))
    assert during == [pytest.approx(SWITCH_INTERVAL)]
    assert sys.getswitchinterval() == before
    steps = in_thread(work)
    next(steps)
    steps.close()
    assert sys.getswitchinterval() == before
