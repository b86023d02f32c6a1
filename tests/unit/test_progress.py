"""One object tells how far nested work is, and stops it."""

from __future__ import annotations

import weakref

import numpy as np
import pytest

from radiosity_addon.base.progress import SILENT, Cancelled, Expected, Progress, Status
from radiosity_addon.numerics import map_chunks
from radiosity_addon.numerics.parallel import AHEAD, SMALLEST, TOGETHER
from tests.watched import noting, watching


def fractions(noted: list[Status]) -> list[float]:
    return [status.fraction for status in noted]


def test_parts_of_parts_lie_where_they_belong() -> None:
    noted: list[Status] = []
    half = noting(noted).part(0.5, 1.0)
    half.part(0.0, 0.5).at(1.0)
    for _, part in half.part(0.5, 1.0).each("ab"):
        part.at(1.0)
    assert fractions(noted) == [0.75, 0.875, 1.0]


def test_turns_take_their_share_of_what_is_left() -> None:
    noted: list[Status] = []
    for _, turn in zip(range(3), noting(noted).turns(0.25), strict=False):
        turn.at(1.0)
    assert fractions(noted) == pytest.approx([0.25, 0.4375, 0.578125])


def test_a_stage_has_a_name_and_its_parts_have_it_too() -> None:
    noted: list[Status] = []
    noting(noted).stage("solve", 0.2, 0.4).part(0.5, 1.0).at(0.0)
    assert noted == [Status("solve", pytest.approx(0.3))]


def test_steps_take_their_share_of_the_expected_time() -> None:
    noted: list[Status] = []
    first, others = noting(noted).expecting([2.0, 6.0])
    first.at(0.5)
    # More is known now: what is left takes twice as long, but lies where it lay.
    second, third = others.expecting([9.0, 3.0])
    second.part(0.0, 0.5).at(1.0)
    third.at(1.0)
    assert fractions(noted) == pytest.approx([0.125, 0.53125, 1.0])
    found = [status.expected for status in noted]
    assert found == [Expected(1.0, 7.0), Expected(6.5, 7.5), Expected(14.0, 0.0)]


def test_what_follows_a_part_takes_as_long_as_its_share_says() -> None:
    noted: list[Status] = []
    for step in noting(noted).part(0.1, 0.9).expecting([4.0, 4.0]):
        step.at(1.0)
    assert [status.expected for status in noted] == [
        Expected(pytest.approx(4.0), pytest.approx(5.0)),
        Expected(pytest.approx(8.0), pytest.approx(1.0)),
    ]


def test_what_work_shows_is_seen_and_nothing_looks_if_nobody_listens() -> None:
    seen: list[object] = []
    watching(seen.append).part(0.0, 0.5).at(0.5, "state")
    Progress(look=seen.append).at(0.5, "unseen")
    SILENT.at(0.5, "unseen")
    assert seen == ["state"]


@pytest.mark.parametrize("threads", [1, 3])
def test_chunks_come_in_order_with_their_slices_and_fractions(threads: int) -> None:
    noted: list[Status] = []
    found = list(map_chunks(lambda rows: rows.start, 10, 4, threads, noting(noted)))
    assert found == [(slice(0, 3), 0), (slice(3, 6), 3), (slice(6, 9), 6), (slice(9, 10), 9)]
    assert fractions(noted) == pytest.approx([0.25, 0.5, 0.75, 1.0])


@pytest.mark.parametrize("rows", [0, 1, 7, 999, 1000, 4000, 4001, 5200, 100_000])
def test_chunks_are_of_one_size_and_a_few_threads_share_them_evenly(rows: int) -> None:
    chunk = 1000
    sizes = [part.stop - part.start for part, _ in map_chunks(lambda _: None, rows, chunk, 1)]
    assert sum(sizes) == rows
    assert max(sizes, default=0) <= chunk
    assert sizes[:-1] == sizes[:1] * len(sizes[:-1])
    if rows >= chunk:
        # No thread of TOGETHER has a slice more than another, but for what rounding leaves of the last.
        assert len(sizes) % TOGETHER == 0
    else:
        assert len(sizes) <= min(TOGETHER, -(-rows * SMALLEST // chunk))


@pytest.mark.parametrize("threads", [1, 3])
def test_a_canceled_job_leaves_the_other_chunks_out(threads: int) -> None:
    done: list[int] = []

    def cancel(_: Status) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        list(map_chunks(lambda rows: done.append(rows.start), 1000, 1, threads, Progress(cancel)))
    assert 1 <= len(done) < 1000


def test_what_was_taken_of_chunks_is_not_kept() -> None:
    threads, alive, most = 2, weakref.WeakValueDictionary[int, np.ndarray](), 0

    def found(rows: slice) -> np.ndarray:
        alive[rows.start] = array = np.zeros(1)
        return array

    for _rows, array in map_chunks(found, 1000, 1, threads):
        del array
        most = max(most, len(alive))
    assert 0 < most <= AHEAD * threads


def test_canceling_is_no_error_that_work_could_handle() -> None:
    assert not issubclass(Cancelled, Exception)
