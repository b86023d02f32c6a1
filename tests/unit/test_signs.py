"""Workers that are to end with their bake see that it is gone, and only then."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from radiosity_addon.farm import Spool
from radiosity_addon.farm.signs import BakeWatch
from radiosity_addon.farm.worker import work


@pytest.fixture
def sign(tmp_path: Path) -> Path:
    return Spool.to_bake(tmp_path).sign


def test_a_bake_that_leaves_is_gone(sign: Path) -> None:
    watch = BakeWatch(sign)
    assert not watch.is_gone()
    Spool(sign.parent).leave()
    assert watch.is_gone()


def test_a_bake_that_begins_is_not_gone(sign: Path) -> None:
    """Its spool is there a moment before its sign."""
    sign.unlink()
    watch = BakeWatch(sign)
    assert not watch.is_gone()
    sign.write_text("elsewhere 1")
    assert not watch.is_gone()
    sign.unlink()
    assert watch.is_gone()


@pytest.mark.skipif(sys.platform == "win32", reason="no process can be asked for here")
def test_a_bake_that_was_killed_is_gone(sign: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as bake:
        sign.write_text(f"{socket.gethostname()} {bake.pid}")
        watch = BakeWatch(sign)
        assert not watch.is_gone()
        bake.kill()
        bake.wait()
        assert watch.is_gone()
    # One that nobody has seen alive may be in another container of this machine.
    assert not BakeWatch(sign).is_gone()


def test_a_bake_elsewhere_is_gone_when_it_is_silent(sign: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the clocks say: its sign may be as old as can be."""
    sign.write_text("elsewhere 1")
    now = 1000.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    watch = BakeWatch(sign)
    for age in range(5):
        os.utime(sign, (age, age))
        now += 59.0
        assert not watch.is_gone()
    now += 61.0
    assert watch.is_gone()


def test_a_worker_ends_with_its_bake(sign: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It would wait for ever else."""
    spool, is_gone, looks = Spool(sign.parent), BakeWatch.is_gone, 0

    def leave_after_a_look(self: BakeWatch) -> bool:
        nonlocal looks
        looks += 1
        gone = is_gone(self)
        if looks == 3:
            spool.leave()
        return gone

    monkeypatch.setattr(BakeWatch, "is_gone", leave_after_a_look)
    assert work(Spool.to_work(sign.parent), with_bake=True) == 0
    assert looks == 4
    assert not spool.is_over()
