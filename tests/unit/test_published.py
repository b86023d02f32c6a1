"""Arrays leave a spool once nobody can ask for them again, and no others do."""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.farm import Spool, published
from radiosity_addon.farm.published import WORTH_KNOWING, PublishedArrays


@pytest.fixture
def spool(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Spool:
    monkeypatch.setattr(published, "GRACE", 0.0)
    return Spool.to_bake(tmp_path / "spool")


def numbers(first: float = 0.0) -> np.ndarray:
    return np.arange(first, first + WORTH_KNOWING, dtype=np.float64)


def stored(spool: Spool) -> set[str]:
    gc.collect()
    return {path.stem for path in (spool.path / "arrays").iterdir()}


def test_an_array_leaves_when_its_memory_is_free(spool: Spool) -> None:
    store, stays = PublishedArrays(spool), numbers(1.0)
    kept, going = store.put_array(stays), store.put_array(numbers())
    part = store.put_array(stays[: len(stays) // 2])
    store.remove_unused()
    # Made for the call, which others may read until it ends.
    assert stored(spool) == {kept, going, part}
    store.end_call()
    store.remove_unused()
    assert stored(spool) == {kept, part}
    # Asked for again it is written again.
    assert store.put_array(numbers()) == going
    assert np.array_equal(Spool.to_work(spool.path).array(going), numbers())


def test_an_array_stays_as_long_as_another_like_it_lives(spool: Spool) -> None:
    store, alike = PublishedArrays(spool), numbers()
    assert store.put_array(numbers()) == store.put_array(alike)
    store.end_call()
    store.remove_unused()
    assert len(stored(spool)) == 1
    del alike
    store.remove_unused()
    assert stored(spool) == set()


def test_what_others_have_written_stays(spool: Spool) -> None:
    digest = Spool.to_work(spool.path).put_array(numbers())
    store = PublishedArrays(spool)
    assert store.put_array(numbers()) == digest
    store.end_call()
    store.remove_unused()
    assert stored(spool) == {digest}
    # Also if it had to be mended.
    (spool.path / "arrays" / f"{digest}.npy").write_bytes(b"")
    assert store.put_array(numbers()) == digest
    store.end_call()
    store.remove_unused()
    assert stored(spool) == {digest}


def test_an_array_stays_for_a_while(spool: Spool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(published, "GRACE", 60.0)
    store = PublishedArrays(spool)
    digest = store.put_array(numbers())
    store.end_call()
    store.remove_unused()
    assert stored(spool) == {digest}
