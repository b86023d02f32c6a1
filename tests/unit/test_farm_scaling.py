"""The simulation of many workers: closed forms of its bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.farm_scaling import Call, Costs, explained, simulated

FREE = Costs(look=0.0, seconds_per_byte=0.0, read=0.0, take=0.0)


def call(tasks: tuple[float, ...], before: float = 1.0) -> Call:
    count = len(tasks)
    return Call("k", before, 0.5, tasks, (0.25,) * count, 1000, (100,) * count)


EVEN = [call((2.0,) * 12), call((1.0,) * 6, before=3.0)]


def test_alone_everything_is_done_one_after_the_other() -> None:
    assert simulated(EVEN, 5.0, 0) == 5.0 + 1.0 + 24.0 + 3.0 + 6.0


@pytest.mark.parametrize(("workers", "seconds"), [(1, 15.0), (2, 10.0), (5, 5.0), (11, 3.0), (1000, 3.0)])
def test_free_workers_divide_even_tasks(workers: int, seconds: float) -> None:
    """The bake works as well: n workers are n + 1."""
    assert simulated(EVEN, 0.0, workers, FREE) == pytest.approx(4.0 + seconds)


def test_no_call_is_faster_than_its_longest_task_nor_than_an_even_division() -> None:
    rng = np.random.default_rng(3)
    calls = [call(tuple(rng.exponential(size=rng.integers(2, 60))), before=0.0) for _ in range(50)]
    for workers in (1, 3, 10, 100):
        for each in calls:
            seconds = simulated([each], 0.0, workers, FREE)
            lower = max(max(each.tasks), sum(each.tasks) / (workers + 1))
            # Graham's bound of giving out tasks in any order.
            assert lower - 1e-9 <= seconds <= sum(each.tasks) / (workers + 1) + max(each.tasks) + 1e-9


def test_what_sharing_costs_is_added() -> None:
    two = call((4.0, 4.0), before=0.0)
    assert simulated([two], 0.0, 1, FREE) == 4.0
    assert simulated([two], 0.0, 1, replace(FREE, look=0.1)) == pytest.approx(4.05)
    # The first of many sees it sooner.
    assert simulated([two], 0.0, 100, replace(FREE, look=0.1)) == pytest.approx(4.0005)
    assert simulated([two], 0.0, 1, replace(FREE, read=1.0)) == pytest.approx(4.5)
    assert simulated([two], 0.0, 1, replace(FREE, take=1.0)) == pytest.approx(4.25)
    # The inputs, and then the result of the worker's task.
    assert simulated([two], 0.0, 1, replace(FREE, seconds_per_byte=0.001)) == pytest.approx(4.0 + 1.0 + 0.1)
    # With more workers than tasks only as many read: they share the bandwidth.
    assert simulated([two], 0.0, 9, replace(FREE, seconds_per_byte=0.0001)) == pytest.approx(4.0 + 0.2 + 0.01)


def test_its_parts_are_bounds() -> None:
    parts = explained(EVEN, 5.0)
    assert parts["not_shared"] == 9.0
    assert (parts["all_tasks"], parts["longest_task_of_each_call"]) == (30.0, 3.0)
    assert parts["without_all_of_these"] == 12.0
    assert parts["without_all_of_these"] < min(parts[name] for name in parts if name.startswith("without_re"))
    assert max(parts[name] for name in parts if name.startswith("without")) <= parts["all"]
