"""What must rest before it is destroyed is kept so long, and no more of it than allowed."""

from __future__ import annotations

import weakref

from radiosity_addon.lightmap.charts.delayed_release import DelayedRelease


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


class Worker:
    pass


def kept(resting: DelayedRelease, clock: Clock, seconds: float) -> weakref.ref[Worker]:
    """Have a worker rest, `seconds` after the last one."""
    clock.now += seconds
    worker = Worker()
    resting.keep(worker)
    return weakref.ref(worker)


def test_each_is_kept_for_its_rest_and_then_let_go() -> None:
    clock = Clock()
    resting = DelayedRelease(rest=0.5, most=10, clock=clock, sleep=clock.sleep)
    first = kept(resting, clock, 0.0)
    second = kept(resting, clock, 0.4)
    assert first() is not None
    third = kept(resting, clock, 0.2)
    assert first() is None
    assert second() is not None
    assert third() is not None


def test_too_many_make_the_next_wait_for_the_oldest() -> None:
    clock = Clock()
    resting = DelayedRelease(rest=0.5, most=3, clock=clock, sleep=clock.sleep)
    workers = [kept(resting, clock, 0.01) for _ in range(20)]
    assert [worker() is not None for worker in workers] == [False] * 17 + [True] * 3
    # Three at a time, half a second each.
    assert clock.now - 100.0 >= 0.5 * 17 // 3
