"""`--farm local:N`: workers that the bake starts, watches and ends; the same bytes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from radiosity_addon.blender.command_line.main import main
from radiosity_addon.farm import LocalWorkers, Spool, local_workers
from radiosity_addon.farm.processes import HelpingProcess
from radiosity_addon.farm.signs import SILENCE, this_process
from tests.moments import until
from tests.processes import ROOT

BAKE = ["bake", "--resolution", "256", "--quality", "sketch", "--no-preview", "--quiet", "--threads", "1"]

WAITING_BAKE = """
import sys
from radiosity_addon.__main__ import leave
from radiosity_addon.blender.command_line.main import main
from radiosity_addon.cli import TemporaryFolder
from tests.app.test_local_workers import waits_to_go
waits_to_go()
leave(main(sys.argv[1:]), TemporaryFolder())
"""

LINUX = pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="no list of processes here")


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The lightmap of one process."""
    folder = tmp_path_factory.mktemp("alone")
    assert main([*BAKE, "--output", str(folder)]) == 0
    return (folder / "lightmap.exr").read_bytes()


@pytest.fixture(autouse=True)
def no_worker_is_left(tmp_path: Path) -> Iterator[None]:
    """However a test ends, no process of its spools goes on."""
    yield
    until(lambda: not workers_of(tmp_path), SILENCE + 20)


def workers_of(folder: Path) -> list[int]:
    """Return the numbers of processes that work in spools below a folder."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_bytes().split(b"\0")
        except OSError:
            continue
        if b"worker" in words and any(word.startswith(os.fsencode(f"{folder}/")) for word in words):
            found.append(int(path.parent.name))
    return found


def claimants(spool: Spool, digest: str) -> set[int]:
    """Return the numbers of other processes that have claimed tasks of a call."""
    claims = [claim.read_text() for claim in (spool.path / "calls" / digest).glob("*.claim")]
    # A claim is there a moment before its text.
    return {int(claim.split()[1]) for claim in claims if claim not in ("", this_process())}


def each_call(monkeypatch: pytest.MonkeyPatch, then: Callable[[Spool, str], None]) -> None:
    """Do something whenever a call is given away, before the bake itself works at it."""
    put_call = Spool.put_call

    def put(self: Spool, text: str) -> str:
        digest = put_call(self, text)
        then(self, digest)
        return digest

    monkeypatch.setattr(Spool, "put_call", put)


def kill_workers(monkeypatch: pytest.MonkeyPatch, count: int) -> set[int]:
    """Kill who works at each call until so many are killed; return where their numbers are collected."""
    killed: set[int] = set()

    def kill_who_works(spool: Spool, digest: str) -> None:
        if len(killed) < count:
            until(lambda: claimants(spool, digest) - killed)
            for number in claimants(spool, digest) - killed:
                os.kill(number, signal.SIGKILL)
                killed.add(number)

    each_call(monkeypatch, kill_who_works)
    return killed


def waits_to_go() -> None:
    """Have the bake of this process leave its first tasks to workers, until there is a file "go"."""
    each_call(pytest.MonkeyPatch(), lambda spool, _: until((spool.path / "go").exists))


def test_the_bake_starts_workers_and_a_spool(
    alone: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    helped: set[int] = set()
    given: dict[str, list[int]] = {}

    def wait_for_both(spool: Spool, digest: str) -> None:
        call = spool.call(digest)
        given.setdefault(call["kernel"]["partial"][0]["function"], []).append(len(call["slices"]))
        if len(helped) < 2:
            until(lambda: claimants(spool, digest) or spool.done(digest))
            helped.update(claimants(spool, digest))

    each_call(monkeypatch, wait_for_both)
    assert main([*BAKE, "--output", str(tmp_path / "out"), "--farm", "local:2"]) == 0
    assert not capsys.readouterr().err
    assert len(helped) == 2
    assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert not workers_of(tmp_path)
    # What was moved, by kernel.
    performance = json.loads((tmp_path / "out" / "report.json").read_text())["performance"]
    shared = {entry.pop("kernel"): entry for entry in performance["shared"]}
    assert sorted(shared) == sorted(given)
    for name, calls in given.items():
        entry = shared[name]
        assert (entry["calls"], entry["tasks"]) == (len(calls), sum(calls))
        assert entry["tasks_done_earlier"] == 0
        assert 0 <= entry["tasks_by_workers"] <= entry["tasks"]
        # Each has its own slices at least, and finds something.
        assert min(entry["input_bytes"], entry["result_bytes"], entry["processor_seconds"]) > 0
    # The first call was left to them, and is of one kernel.
    assert sum(entry["tasks_by_workers"] for entry in shared.values()) >= 2


def test_a_spool_that_was_given_stays(alone: bytes, tmp_path: Path) -> None:
    words = ["--output", str(tmp_path / "out"), "--farm", "local:1", "--spool", str(tmp_path / "spool")]
    assert main([*BAKE, *words]) == 0
    assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone
    assert sorted(path.name for path in (tmp_path / "spool").iterdir()) == ["over", "spool.json"]
    assert not workers_of(tmp_path)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no such signal here")
def test_workers_that_are_killed_are_started_again(
    alone: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    killed = kill_workers(monkeypatch, 3)
    assert main([*BAKE, "--output", str(tmp_path / "out"), "--farm", "local:1"]) == 0
    assert len(killed) == 3
    assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone
    assert not json.loads((tmp_path / "out" / "report.json").read_text())["warnings"]


def test_workers_that_cannot_work_are_given_up(
    alone: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    starts = 0

    def fails(_: Spool) -> HelpingProcess:
        nonlocal starts
        starts += 1
        return HelpingProcess([sys.executable, "-c", "import sys; sys.exit('error: no such library')"])

    monkeypatch.setattr(local_workers, "start_worker", fails)
    given_up: list[LocalWorkers] = []
    start = LocalWorkers.start

    def note(self: LocalWorkers, spool: Spool) -> None:
        given_up.append(self)
        start(self, spool)

    monkeypatch.setattr(LocalWorkers, "start", note)
    each_call(monkeypatch, lambda *_: until(lambda: len(given_up[0].problems) == 2))
    assert main([*BAKE, "--output", str(tmp_path / "out"), "--farm", "local:2"]) == 0
    assert starts == 8
    assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone
    warnings = json.loads((tmp_path / "out" / "report.json").read_text())["warnings"]
    assert sorted(warning["message"] for warning in warnings) == [
        f"worker {number} of 2 ended 4 times and was given up; last: error: no such library"
        for number in (1, 2)
    ]


def test_workers_of_a_bake_that_is_over_are_not_started_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spool, starts, looks = Spool.to_bake(tmp_path), 0, 0
    over, start = spool.is_over, local_workers.start_worker

    def started(each: Spool) -> HelpingProcess:
        nonlocal starts
        starts += 1
        return start(each)

    def looked() -> bool:
        nonlocal looks
        looks += 1
        return over()

    monkeypatch.setattr(local_workers, "start_worker", started)
    monkeypatch.setattr(spool, "is_over", looked)
    workers = LocalWorkers(2)
    spool.say_over()
    workers.start(spool)
    # Both have ended, and were looked at again.
    until(lambda: looks > 5)
    workers.end()
    assert starts == 2
    assert not workers.problems


def waiting_bake(folder: Path) -> subprocess.Popen[str]:
    """Start a bake with workers; return when it waits with some of its tasks done."""
    words = [sys.executable, "-c", WAITING_BAKE, *BAKE, "--output", folder / "out", "--farm", "local:2"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    baking = subprocess.Popen(list(map(str, words)), cwd=ROOT, text=True, start_new_session=True, **pipes)
    until(lambda: len(list(folder.glob("out-spool/calls/*/*.result"))) >= 2)
    return baking


@LINUX
@pytest.mark.parametrize(
    "kill",
    [
        pytest.param(signal.SIGINT, id="Ctrl-C"),
        # Workers wait a minute for the bake; test_shared_bakes.py has a killed bake that goes on.
        pytest.param(signal.SIGKILL, id="kill", marks=pytest.mark.full),
    ],
)
def test_an_interrupted_bake_leaves_no_worker_and_goes_on(
    kill: signal.Signals, alone: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    baking, spool = waiting_bake(tmp_path), tmp_path / "out-spool"
    assert len(workers_of(tmp_path)) == 2
    os.kill(baking.pid, kill)
    (spool / "go").touch()
    _, said = baking.communicate(timeout=60)
    if kill == signal.SIGINT:
        assert baking.returncode == 130
        assert said == (
            f"error: interrupted; nothing was written; what was computed is kept in '{spool}': the same "
            "command goes on with it\n"
        )
        assert not workers_of(tmp_path)
    # By themselves: nobody ends them. One that had not yet seen the bake alive waits for its silence.
    until(lambda: not workers_of(tmp_path), SILENCE + 20)
    (spool / "go").unlink()
    before = {path: path.stat().st_mtime_ns for path in spool.glob("calls/*/*.result")}
    assert len(before) >= 2
    kept: set[Path] = set()
    end = Spool.end

    def note(self: Spool) -> None:
        kept.update(path for path in before if path.exists() and path.stat().st_mtime_ns == before[path])
        end(self)

    monkeypatch.setattr(Spool, "end", note)
    assert main([*BAKE, "--output", str(tmp_path / "out"), "--farm", "local:1"]) == 0
    assert kept == set(before)
    performance = json.loads((tmp_path / "out" / "report.json").read_text())["performance"]
    assert sum(entry["tasks_done_earlier"] for entry in performance["shared"]) == len(before)
    assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_one_command_starts_a_machines_workers(alone: bytes, tmp_path: Path) -> None:
    """`worker DIR --processes N`: they end with the bake, and the command when they have."""
    words = [sys.executable, "-m", "radiosity_addon.farm", "worker", tmp_path / "spool"]
    words += ["--wait", "60", "--processes", "2"]
    with subprocess.Popen(list(map(str, words)), cwd=ROOT, stderr=subprocess.PIPE, text=True) as command:
        with pytest.MonkeyPatch.context() as patch:
            each_call(patch, lambda spool, digest: until(lambda: claimants(spool, digest)))
            given = ["--output", str(tmp_path / "out"), "--spool", str(tmp_path / "spool")]
            assert main([*BAKE, *given]) == 0
        assert command.communicate(timeout=60)[1] == ""
    assert command.returncode == 0
    assert not workers_of(tmp_path)
    assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone


def test_an_error_before_the_first_task_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--output", str(tmp_path / "out"), "--farm", "local:2", "--objects", "Nothing of this name"]
    assert main([*BAKE, *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("made", ["folder", "file", "spool", "other"])
def test_what_has_the_name_of_the_spool_is_left_alone(
    made: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "out-spool"
    if made == "file":
        path.write_text("mine")
    elif made == "folder":
        path.mkdir()
        (path / "thesis.txt").write_text("mine")
    elif made == "spool":
        Spool.to_bake(path).end()
    else:
        Spool.to_bake(path, made_for=tmp_path / "elsewhere").end()
    before = sorted(tmp_path.rglob("*"))
    assert main([*BAKE, "--output", str(tmp_path / "out"), "--farm", "local:1"]) == 1
    assert capsys.readouterr().err == (
        f"error: '{path}' is in the way of the bake's spool: rename it, or give a folder with --spool\n"
    )
    assert sorted(tmp_path.rglob("*")) == before


def test_a_spool_left_by_an_earlier_version_is_replaced(alone: bytes, tmp_path: Path) -> None:
    path = tmp_path / "out-spool"
    left = Spool.to_bake(path, made_for=tmp_path / "out")
    left.put_call("{}")
    left.leave()
    (path / "notes.txt").write_text("mine")
    record = json.loads((path / "spool.json").read_text())
    record["program"]["version"] = "older"
    (path / "spool.json").write_text(json.dumps(record))
    words = [*BAKE, "--output", str(tmp_path / "out"), "--farm", "local:1"]
    assert main(words) == 1  # what others put there is not taken away
    assert [file.name for file in path.iterdir()] == ["notes.txt"]
    (path / "notes.txt").unlink()
    assert main(words) == 0
    assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone
    assert not path.exists()


@pytest.mark.parametrize(
    "spec", ["local:0", "local:x", "local:-1", "local:1.5", "local:", "local:257", f"local:{10**30}", "four"]
)
def test_other_numbers_of_workers_are_usage_errors(
    spec: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*BAKE, "--output", str(tmp_path / "out"), "--farm", spec]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: --farm ")
    assert said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
