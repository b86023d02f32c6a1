"""A spool is whole, or made whole, whatever is done to its files; what is not its own is left alone."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from radiosity_addon.base import BakeError
from radiosity_addon.farm import Spool, shared_bake
from radiosity_addon.farm.identity import identity
from radiosity_addon.farm.objects import ObjectError, digest_of
from radiosity_addon.farm.signs import this_process
from radiosity_addon.farm.status import status_lines
from radiosity_addon.farm.tasks import KERNELS
from radiosity_addon.farm.worker import work


@pytest.fixture
def spool(tmp_path: Path) -> Spool:
    return Spool.to_bake(tmp_path / "spool")


def test_a_folder_of_other_things_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(BakeError, match="is not empty and no spool"):
        Spool.to_bake(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]
    with pytest.raises(BakeError, match="is no spool"):
        Spool.to_work(tmp_path)


@pytest.mark.parametrize("name", sorted(identity()))
def test_another_program_is_refused_by_what_differs(spool: Spool, name: str) -> None:
    record = json.loads((spool.path / "spool.json").read_text())
    record["program"][name] = "other"
    (spool.path / "spool.json").write_text(json.dumps(record))
    for make in (Spool.to_work, Spool.to_bake):
        with pytest.raises(BakeError, match=f"of another {name}"):
            make(spool.path)


def test_a_spool_belongs_to_one_bake(spool: Spool) -> None:
    sign = spool.path / "baking"
    assert sign.read_text() == this_process()
    host = socket.gethostname()
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
        sign.write_text(f"{host} {other.pid}")
        with pytest.raises(BakeError, match=f"is used by process {other.pid} on {host}"):
            Spool.to_bake(spool.path)
    # Gone now.
    Spool.to_bake(spool.path)
    sign.write_text(f"{host} {10**30}")
    Spool.to_bake(spool.path)
    sign.write_text("elsewhere 1")
    with pytest.raises(BakeError, match="is used by process 1 on elsewhere"):
        Spool.to_bake(spool.path)
    os.utime(sign, (time.time() - 100,) * 2)
    Spool.to_bake(spool.path)
    assert sign.read_text() == this_process()


CALL = '{"kernel": null, "slices": [[0, 1]]}'


@pytest.mark.parametrize("content", [b"", b"{", CALL[:-1].encode(), b"\xff" * len(CALL)])
def test_a_damaged_call_is_left_alone_and_written_again(spool: Spool, content: bytes) -> None:
    digest = spool.put_call(CALL)
    (spool.path / "calls" / digest / "call.json").write_bytes(content)
    said: list[str] = []
    assert work(Spool.to_work(spool.path), 0.1, said.append) == 0
    assert said == [f"call {digest} is left to others: call {digest} is damaged"]
    assert status_lines(spool) == [f"the call that waits cannot be read: call {digest} is damaged"]
    spool.put_call(CALL)
    assert spool.call(digest) == json.loads(CALL)


@pytest.mark.parametrize("text", ["no JSON", "[" * 100_000])
def test_a_hostile_call_is_left_alone(spool: Spool, text: str) -> None:
    digest = spool.put_call(text)
    said: list[str] = []
    assert work(Spool.to_work(spool.path), 0.1, said.append) == 0
    assert said[0].startswith(f"call {digest} is left to others: ")
    assert status_lines(spool)[0].startswith("the call that waits cannot be read: ")


@pytest.mark.parametrize("content", ["", "{", "[]"])
def test_a_damaged_spool_asks_for_another_folder(spool: Spool, content: str) -> None:
    (spool.path / "spool.json").write_text(content)
    for make in (Spool.to_work, Spool.to_bake):
        with pytest.raises(BakeError, match=r"spool\.json' is damaged: .* in an empty folder"):
            make(spool.path)


def test_a_spool_whose_making_was_killed_is_made(tmp_path: Path) -> None:
    (tmp_path / f".{'a' * 32}").write_text("{")
    Spool.to_bake(tmp_path).end()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["over", "spool.json"]


def test_a_disk_that_is_full_at_first_can_be_emptied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is left that would make the folder one of other things, or keep the disk full."""

    def full(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", full)
        with pytest.raises(BakeError, match="No space left on device"):
            Spool.to_bake(tmp_path)
    assert list(tmp_path.iterdir()) == []
    spool = Spool.to_bake(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", full)
        with pytest.raises(BakeError, match="No space left on device"):
            spool.put_array(np.arange(5000.0))
    assert list((tmp_path / "aside").iterdir()) == []


def test_arrays_that_do_not_fit_say_why(spool: Spool, monkeypatch: pytest.MonkeyPatch) -> None:
    """NumPy's error has no reason in the system's words."""

    def save(*_: object, **__: object) -> None:
        raise OSError("5000 requested and 0 written")

    monkeypatch.setattr(np, "save", save)
    with pytest.raises(BakeError, match=r"cannot write to spool '.*': its disk may be full; see to it"):
        spool.put_array(np.arange(5000.0))


def test_a_worker_that_cannot_write_says_so(spool: Spool, monkeypatch: pytest.MonkeyPatch) -> None:
    """It would else wait for an hour, and nobody knew why."""
    kernel = f'{{"partial": [{{"function": "{min(KERNELS)}"}}, {{"tuple": []}}, {{"dict": []}}]}}'
    digest = spool.put_call(f'{{"kernel": {kernel}, "slices": [[0, 1]]}}')
    to_open = Path.open

    def denied(self: Path, mode: str = "r", *more: Any, **named: Any) -> Any:
        if "r" not in mode:
            raise PermissionError(13, "Permission denied")
        return to_open(self, mode, *more, **named)

    monkeypatch.setattr(Path, "open", denied)
    with pytest.raises(BakeError, match=r"cannot write to spool '.*': Permission denied"):
        work(Spool.to_work(spool.path), 0.1)
    assert spool.claimed(digest) == set()


def test_a_result_that_comes_after_the_end_leaves_nothing(spool: Spool) -> None:
    digest, late = spool.put_call("{}"), Spool.to_work(spool.path)
    spool.end()
    with pytest.raises(BakeError):
        late.put_result(digest, 0, None, [])
    assert sorted(path.name for path in spool.path.iterdir()) == ["over", "spool.json"]


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights here")
@pytest.mark.parametrize("name", ["arrays", "objects", "calls", "aside"])
def test_nothing_is_removed_through_links(spool: Spool, tmp_path: Path, name: str) -> None:
    mine = tmp_path / "mine"
    names = [f"{'a' * 40}.npy", f"{'a' * 40}.json", "b" * 32, f"{'c' * 40}/1.claim"]
    for each in names:
        (mine / each).parent.mkdir(parents=True, exist_ok=True)
        (mine / each).write_text("mine")
    (spool.path / name).rmdir()
    (spool.path / name).symlink_to(mine)
    for make in (Spool.to_work, Spool.to_bake):
        with pytest.raises(BakeError, match=f"{name}' is a link out of the spool: remove it"):
            make(spool.path)
    spool.end()
    assert all((mine / each).read_text() == "mine" for each in names)


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights here")
def test_calls_that_are_links_are_neither_worked_at_nor_emptied(spool: Spool, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "call.json").write_text(CALL)
    (mine / "0.claim").write_text("mine")
    digest = digest_of(CALL)
    link = spool.path / "calls" / digest
    link.symlink_to(mine)
    with pytest.raises(ObjectError):
        spool.call(digest)
    assert spool.put_call(CALL) == digest
    assert not link.is_symlink()
    assert sorted(path.name for path in mine.iterdir()) == ["0.claim", "call.json"]


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights here")
def test_files_that_are_links_are_not_read(spool: Spool, tmp_path: Path) -> None:
    """Not even if what they lead to is what was written: nothing outside is read."""
    array, text = np.arange(300.0), "[1]"
    digest, name, call = spool.put_array(array), digest_of(text), spool.put_call(CALL)
    spool.put_object(name, text)
    spool.put_result(call, 0, None, [])
    files = [f"arrays/{digest}.npy", f"objects/{name}.json", f"calls/{call}/0.result", "open", "spool.json"]
    for number, file in enumerate(files):
        (spool.path / file).rename(tmp_path / str(number))
        (spool.path / file).symlink_to(tmp_path / str(number))
    other = Spool(spool.path)
    for read in (lambda: other.array(digest), lambda: other.object(name)):
        with pytest.raises(ObjectError, match="no file of ours"):
            read()
    assert other.result(call, 0) is None
    assert other.open_call() is None
    with pytest.raises(BakeError, match="is damaged"):
        Spool.to_work(spool.path)
    other.put_array(array)
    other.put_object(name, text)
    np.testing.assert_array_equal(other.array(digest), array)
    assert other.object(name) == text
    assert np.load(tmp_path / "0").sum() == array.sum()


def test_other_machines_see_a_bake_through_all_of_its_stages(
    spool: Spool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also if no kernel is shared for long; and as soon as it fails, another may go on with it."""
    monkeypatch.setattr("radiosity_addon.farm.signs.SILENCE", 0.1)
    sign = spool.path / "baking"

    def fail_late() -> None:
        with shared_bake(spool):
            os.utime(sign, (0, 0))
            end = time.monotonic() + 20
            while not sign.stat().st_mtime:
                assert time.monotonic() < end
                time.sleep(0.01)
            raise BakeError("no light")

    with pytest.raises(BakeError, match="no light"):
        fail_late()
    assert not sign.exists()


def test_what_others_put_into_a_spool_stays(spool: Spool) -> None:
    digest = spool.put_call("{}")
    spool.put_array(np.arange(5000.0))
    names = ["mine.txt", ".mine", "arrays/mine.npy", "calls/mine/call.json", f"calls/{digest}/notes.txt"]
    for name in names:
        (spool.path / name).parent.mkdir(exist_ok=True)
        (spool.path / name).write_text("mine")
    spool.end()
    left = [path.relative_to(spool.path).as_posix() for path in spool.path.rglob("*") if path.is_file()]
    assert sorted(left) == sorted([*names, "over", "spool.json"])
