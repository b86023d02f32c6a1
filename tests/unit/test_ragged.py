"""Runs of different length against loops over them."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics import run_chunks, run_numbers, run_starts

COUNTS = [[], [0], [3], [0, 2, 0, 0, 5, 1, 0], np.random.default_rng(4).integers(0, 9, 500).tolist()]


@pytest.mark.parametrize("counts", COUNTS)
def test_runs_begin_where_the_one_before_ends(counts: list[int]) -> None:
    count = np.array(counts, dtype=np.int64)
    assert run_starts(count).tolist() == [sum(counts[:number]) for number in range(len(counts))]


@pytest.mark.parametrize("counts", COUNTS)
def test_numbers_go_up_within_each_run(counts: list[int]) -> None:
    count = np.array(counts, dtype=np.int32)
    assert run_numbers(count).tolist() == [number for size in counts for number in range(size)]
    begin = np.random.default_rng(5).integers(-50, 50, len(counts))
    expected = [number for size, at in zip(counts, begin, strict=True) for number in range(at, at + size)]
    assert run_numbers(count, begin).tolist() == expected


@pytest.mark.parametrize("most", [1, 4, 7, 10_000])
@pytest.mark.parametrize("counts", COUNTS)
def test_chunks_hold_every_run_once_and_no_run_more_fits(counts: list[int], most: int) -> None:
    chunks = list(run_chunks(np.array(counts, dtype=np.int64), most))
    assert [number for part in chunks for number in range(part.start, part.stop)] == list(range(len(counts)))
    for part in chunks:
        assert part.stop - part.start == 1 or sum(counts[part]) <= most
        if part.stop < len(counts):
            assert sum(counts[part.start : part.stop + 1]) > most
