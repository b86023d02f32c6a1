"""Arrays leave a spool once nobody can ask for them again, and no others do."""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.base import BakeError
from radiosity_addon.farm import Spool, published
from radiosity_addon.farm.published import WORTH_KNOWING, PublishedArrays
from radiosity_addon.farm.spool import PREPARED


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


def test_what_an_interrupted_bake_has_left_leaves_as_well(spool: Spool) -> None:
    Spool.to_work(spool.path).put_array(numbers())
    store = PublishedArrays(spool)
    store.put_array(numbers())
    store.end_call()
    store.remove_unused()
    assert stored(spool) == set()


def test_what_was_prepared_stays(spool: Spool) -> None:
    digest = Spool.to_work(spool.path).put_array(numbers())
    spool.point(PREPARED, digest)
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


@pytest.mark.parametrize("name", ["arrays", "aside"])
def test_nothing_is_written_or_removed_through_links(spool: Spool, tmp_path: Path, name: str) -> None:
    store, outside = PublishedArrays(spool), tmp_path / "outside"
    digest = store.put_array(numbers())
    (spool.path / name).rename(outside)
    (spool.path / name).symlink_to(outside)
    before = sorted(outside.iterdir())
    store.end_call()
    store.remove_unused()
    with pytest.raises(BakeError, match=f"{name}' is a link out of the spool: remove it"):
        store.put_array(numbers(1.0))
    assert sorted(outside.iterdir()) == before
    assert (spool.path / "arrays" / f"{digest}.npy").exists() == (name == "arrays")


def test_no_call_is_put_through_a_link(spool: Spool, tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    (spool.path / "calls").rename(outside)
    (spool.path / "calls").symlink_to(outside)
    with pytest.raises(BakeError, match="calls' is a link out of the spool: remove it"):
        spool.put_call("{}")
    assert list(outside.iterdir()) == []


def test_an_array_stays_for_a_while(spool: Spool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(published, "GRACE", 60.0)
    store = PublishedArrays(spool)
    digest = store.put_array(numbers())
    store.end_call()
    store.remove_unused()
    assert stored(spool) == {digest}
