"""A generator advanced in a thread behaves as if it were not."""

from __future__ import annotations

import sys
import threading
from collections.abc import Generator

import pytest

from radiosity_addon.blender.session.background import TURN, in_thread


def finish(steps: Generator) -> tuple[list, object]:
    """All that a generator yields but None, and what it returns."""
    yielded = []
    while True:
        try:
            value = next(steps)
        except StopIteration as end:
            return yielded, end.value
        if value is not None:
            yielded.append(value)


def test_what_it_yields_and_returns_comes_through() -> None:
    threads = set()

    def work() -> Generator[int, None, str]:
        for number in range(5):
            threads.add(threading.current_thread())
            yield number
        return "result"

    assert finish(in_thread(work())) == ([0, 1, 2, 3, 4], "result")
    assert len(threads) == 1
    assert threading.main_thread() not in threads


def test_what_it_raises_comes_through() -> None:
    def work() -> Generator[int, None, None]:
        yield 1
        raise ValueError("the reason")

    with pytest.raises(ValueError, match="the reason"):
        finish(in_thread(work()))


def test_a_long_step_does_not_hold_the_caller() -> None:
    go_on = threading.Event()

    def work() -> Generator[str, None, None]:
        go_on.wait(60)
        yield "done"

    steps = in_thread(work())
    assert [next(steps) for _ in range(3)] == [None, None, None]
    go_on.set()
    assert finish(steps) == (["done"], None)


def test_the_steps_go_on_while_the_caller_does_something_else() -> None:
    arrived = threading.Event()

    def work() -> Generator[int, None, None]:
        yield from range(3)
        arrived.set()

    steps = in_thread(work())
    first = next(steps)
    assert arrived.wait(60)
    assert (first, finish(steps)) in [(0, ([1, 2], None)), (None, ([0, 1, 2], None))]


def test_closing_in_a_step_returns_at_once_and_closes_the_work_after_it() -> None:
    go_on, closed, goes_on = threading.Event(), threading.Event(), []

    def work() -> Generator[str, None, None]:
        try:
            go_on.wait(60)
            yield "the step that was running"
            goes_on.append(True)
        finally:
            closed.set()

    steps = in_thread(work())
    assert next(steps) is None
    steps.close()
    assert not closed.is_set()
    go_on.set()
    assert closed.wait(60)
    assert goes_on == []


def test_turns_are_short_while_it_runs_and_as_before_afterwards() -> None:
    """A window that is drawn asks for Python's lock dozens of times; each takes a turn at most."""
    before, during = sys.getswitchinterval(), []

    def work() -> Generator[int, None, None]:
        during.append(sys.getswitchinterval())
        yield 1

    finish(in_thread(work()))
    assert during == [pytest.approx(TURN)]
    assert sys.getswitchinterval() == before
    steps = in_thread(work())
    next(steps)
    steps.close()
    assert sys.getswitchinterval() == before
