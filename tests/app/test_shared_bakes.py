"""A bake that several processes share gives the same bytes, whatever happens to them."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake, bake_and_keep
from radiosity_addon.base import BakeError
from radiosity_addon.blender.command_line.main import main
from radiosity_addon.farm import Spool, published, run_command, shared_bake
from radiosity_addon.farm.tasks import KERNELS
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from tests.glass_rooms import glazed_room
from tests.moments import until, waits_for_a_worker
from tests.moved_rooms import room
from tests.processes import ROOT

SETTINGS = BakeSettings(resolution=320, quality="sketch", threads=1)

ROOMS = {"room": room, "glass": glazed_room}

BAKE = """
import sys
from pathlib import Path
from radiosity_addon.farm import executor, published
from tests.app.test_shared_bakes import baked_bytes, ROOMS
from tests.moments import ends_after, waits_for_a_worker
spool, name, kernel, results = sys.argv[1:]
# What is not needed any more leaves at once.
published.GRACE = 0.0
if kernel:
    # A small room's calls have few slices.
    executor.FEWEST = 2
    waits_for_a_worker(kernel)
if int(results):
    ends_after(int(results))
print(baked_bytes(ROOMS[name](), Path(spool)))
"""

DYING_WORKER = """
import sys
from pathlib import Path
from radiosity_addon.farm.__main__ import main
from tests.moments import dies_with_a_task_of
spool, kernel = sys.argv[1:]
dies_with_a_task_of(kernel)
main(["worker", spool, "--idle", "60"])
"""


def baked_bytes(scene: BakeScene, spool: Path | None = None) -> str:
    """Return a digest of a scene's lightmap, baked here or with the workers of a spool."""
    with nullcontext() if spool is None else shared_bake(Spool.to_bake(spool)):
        result = bake(scene, SETTINGS)
    return hashlib.sha1(b"".join(page.pixels.tobytes() for page in result.pages)).hexdigest()


# The room without glass repeats the checks of the one with it.
@pytest.fixture(scope="module", params=["glass", pytest.param("room", marks=pytest.mark.full)])
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def alone(name: str) -> str:
    """The lightmap that one process bakes."""
    return baked_bytes(ROOMS[name]())


@pytest.fixture
def workers(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts workers of `tmp_path / "spool"`, as soon as it exists; one that dies if told at which kernel."""
    with ExitStack() as stack:

        def start(dies_at: str = "") -> subprocess.Popen[str]:
            spool = tmp_path / "spool"
            until((spool / "spool.json").exists)
            usual = ["-m", "radiosity_addon.farm", "worker", spool, "--idle", "60"]
            words = ["-c", DYING_WORKER, spool, dies_at] if dies_at else usual
            worker = subprocess.Popen(
                [sys.executable, *map(str, words)],
                cwd=ROOT,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            stack.callback(worker.wait)
            stack.callback(worker.kill)
            return worker

        yield start


def start_bake(spool: Path, name: str, kernel: str = "", results: int = 0) -> subprocess.Popen[str]:
    """Bake a room in a process of its own.

    kernel: One whose first call is left to workers until one of them has claimed a task.
    results: The number of results after which the process is killed; 0 for never.
    """
    words = [sys.executable, "-c", BAKE, str(spool), name, kernel, str(results)]
    return subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True)


# Tests below have one worker, too.
@pytest.mark.parametrize("count", [0, pytest.param(1, marks=pytest.mark.full), 3])
def test_any_number_of_workers_gives_the_same_bytes(
    count: int,
    name: str,
    alone: str,
    tmp_path: Path,
    workers: Callable[[], subprocess.Popen[str]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(published, "GRACE", 0.0)
    Spool.to_bake(tmp_path / "spool")
    helping = [workers() for _ in range(count)]
    if count:
        monkeypatch.setattr(Spool, "put_call", Spool.put_call)
        waits_for_a_worker()
    assert baked_bytes(ROOMS[name](), tmp_path / "spool") == alone
    done = [worker.communicate(timeout=60) for worker in helping]
    assert all(worker.returncode == 0 for worker in helping), done
    # What the bake leaves: nothing but that it was here.
    assert sorted(path.name for path in (tmp_path / "spool").iterdir()) == ["over", "spool.json"]
    if count:
        assert sum(int(said.split()[0]) for said, _ in done) > 0


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no such signal here")
@pytest.mark.parametrize(
    "kernel",
    [
        "solver.gather.soft_shadows:_shadowed",
        "lightmap.points.interpolation:_supported",
        "solver.gather.final_gather:_trace",
    ],
)
def test_a_worker_that_is_killed_costs_its_task_alone(
    kernel: str, name: str, alone: str, tmp_path: Path, workers: Callable[[str], subprocess.Popen[str]]
) -> None:
    baking = start_bake(tmp_path / "spool", name, kernel)
    assert workers(kernel).wait(timeout=120) == -signal.SIGKILL
    assert baking.communicate(timeout=120)[0].strip() == alone


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no such signal here")
def test_a_bake_that_is_killed_goes_on_where_it_was(name: str, alone: str, tmp_path: Path) -> None:
    spool = tmp_path / "spool"
    assert start_bake(spool, name, results=12).wait(timeout=120) == -signal.SIGKILL
    before = {path: path.stat().st_mtime_ns for path in spool.glob("calls/*/*.result")}
    # What is damaged meanwhile is done again, and nothing else.
    truncated, flipped = sorted(before)[:2]
    truncated.write_bytes(truncated.read_bytes()[:-1])
    content = bytearray(flipped.read_bytes())
    content[-1] ^= 8
    flipped.write_bytes(content)
    kept, end = Spool.to_bake(spool), Spool.end
    seen: dict[Path, int] = {}

    def note(self: Spool) -> None:
        seen.update((path, path.stat().st_mtime_ns) for path in before)
        end(self)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Spool, "end", note)
        assert baked_bytes(ROOMS[name](), kept.path) == alone
    again = {path for path in before if seen[path] != before[path]}
    assert again == {truncated, flipped}


def test_kept_bakes_can_be_shared_and_relit(tmp_path: Path) -> None:
    scene = room()
    alone, kept = bake_and_keep(scene, SETTINGS)
    with shared_bake(Spool.to_bake(tmp_path)):
        shared, also_kept = bake_and_keep(scene, SETTINGS)
    assert shared.pages[0].pixels.tobytes() == alone.pages[0].pixels.tobytes()
    for light in kept.lit.gains.gain_of:
        assert (kept.lit.gains.of(light) == also_kept.lit.gains.of(light)).all()


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="no such users here")
def test_a_full_disk_is_one_line_and_what_is_done_stays(
    name: str, alone: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    count, replace = 0, Path.replace

    def full(self: Path, target: Path) -> Path:
        nonlocal count
        count += 1
        if count > 60:
            raise OSError(28, "No space left on device")
        return replace(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", full)
        with pytest.raises(BakeError, match=r"cannot write to spool .*: No space left on device; see to it"):
            baked_bytes(ROOMS[name](), tmp_path)
    assert list(tmp_path.glob("calls/*/*.result"))
    assert baked_bytes(ROOMS[name](), tmp_path) == alone


def test_the_command_line_shares_a_bake(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["bake", "--resolution", "64", "--quality", "sketch", "--no-preview", "--quiet"]
    assert main([*words, "--output", str(tmp_path / "alone")]) == 0
    assert main([*words, "--output", str(tmp_path / "shared"), "--spool", str(tmp_path / "spool")]) == 0
    alone, shared = ((tmp_path / name / "lightmap.exr").read_bytes() for name in ("alone", "shared"))
    assert alone == shared
    assert not capsys.readouterr().err


def test_a_folder_of_other_things_is_refused_before_the_bake(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    assert main(["bake", "--output", str(tmp_path / "out"), "--spool", str(tmp_path)]) == 1
    assert capsys.readouterr().err.strip().endswith("is not empty and no spool: give an empty folder")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["thesis.txt"]


def test_a_file_is_no_spool(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    words = ["bake", "--output", str(tmp_path / "out"), "--spool", str(tmp_path / "thesis.txt")]
    assert main(words) == 1
    assert capsys.readouterr().err.strip().endswith("thesis.txt' is no folder: give an empty folder")
    assert (tmp_path / "thesis.txt").read_text() == "mine"


@pytest.mark.parametrize("was_there", [False, True])
def test_an_error_before_the_first_result_leaves_no_spool(was_there: bool, tmp_path: Path) -> None:
    """Workers would wait at it for a bake that is not there."""
    if was_there:
        (tmp_path / "spool").mkdir()
    words = ["bake", "--output", str(tmp_path / "out"), "--spool", str(tmp_path / "spool")]
    assert main([*words, "--objects", "Nobody"]) == 2
    assert [path.name for path in tmp_path.rglob("*")] == (["spool"] if was_there else [])


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="no such users here")
def test_after_a_full_disk_the_command_line_says_what_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["bake", "--resolution", "256", "--quality", "sketch", "--no-preview", "--quiet"]
    words += ["--output", str(tmp_path / "out"), "--spool", str(tmp_path / "spool")]
    put_result, count = Spool.put_result, 0

    def full(self: Spool, *found: Any) -> None:
        nonlocal count
        count += 1
        if count > 3:
            raise BakeError(f"cannot write to spool '{self.path}'")
        put_result(self, *found)

    with monkeypatch.context() as patch:
        patch.setattr(Spool, "put_result", full)
        assert main(words) == 1
    said = capsys.readouterr().err
    assert f"what was computed is kept in '{tmp_path / 'spool'}'" in said
    assert said.count("kept") == 1
    assert list((tmp_path / "spool").glob("calls/*/*.result"))
    assert main(words) == 0


@pytest.mark.parametrize("flag", ["--relight", "--check"])
@pytest.mark.parametrize("how", ["spool", "farm"])
def test_what_traces_no_rays_has_nothing_to_share(
    flag: str, how: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shared = {"spool": str(tmp_path / "spool"), "farm": "local:2"}[how]
    assert main(["bake", flag, "--output", str(tmp_path / "out"), f"--{how}", shared]) == 2
    assert f"leave --{how} out" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_worker_runs_nothing_but_kernels(tmp_path: Path) -> None:
    """A call of another function is left alone, and said."""
    spool = Spool.to_bake(tmp_path)
    name = "numerics.parallel:thread_count"
    assert name not in KERNELS
    empty = '{"tuple": []}, {"dict": []}'
    spool.put_call(f'{{"kernel": {{"partial": [{{"function": "{name}"}}, {empty}]}}, "slices": [[0, 1]]}}')
    words = [sys.executable, "-m", "radiosity_addon.farm", "worker", str(tmp_path), "--idle", "0.5"]
    ran = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert ran.returncode == 0
    assert "no kernel" in ran.stdout
    assert "0 tasks done" in ran.stdout
    assert not list(tmp_path.glob("calls/*/*.result"))


def test_a_worker_can_wait_for_the_spool(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What queues start at the same time as the bake."""
    spool, looks = tmp_path / "later", 0
    sleep = time.sleep

    def make_at_the_third_look(seconds: float) -> None:
        nonlocal looks
        looks += 1
        if looks == 3:
            Spool.to_bake(spool).say_over()
        sleep(min(seconds, 0.01))

    monkeypatch.setattr(time, "sleep", make_at_the_third_look)
    assert run_command(["worker", str(spool), "--wait", "60"]) == 0
    assert looks == 3
    monkeypatch.undo()
    assert run_command(["worker", str(tmp_path / "never"), "--wait", "0.1"]) == 1


@pytest.mark.parametrize("words", ["--wait -1", "--wait soon", "--idle nan", "--processes -1"])
def test_what_is_no_number_is_a_usage_error(
    words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(["worker", str(tmp_path), *words.split()]) == 2
    assert "error: " in capsys.readouterr().err


def test_blender_itself_runs_workers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`blender -b --command radiosity worker DIR`, where no other Python has our packages."""
    from radiosity_addon.blender.command_line import host

    assert host.run(["worker", str(tmp_path / "none")]) == 1
    assert capsys.readouterr().err.endswith("is no spool; start the bake first, with --spool\n")
    Spool.to_bake(tmp_path).end()
    assert host.run(["worker", str(tmp_path)]) == 0
    assert capsys.readouterr().out == "0 tasks done\n"
    assert host.run(["status", str(tmp_path)]) == 0
    assert capsys.readouterr().out == "the bake has ended\n"


@pytest.mark.skipif(sys.platform == "win32", reason="no such shell here")
def test_a_list_of_tasks_may_be_cut_short(tmp_path: Path) -> None:
    spool = Spool.to_bake(tmp_path)
    slices = [[number, number + 1] for number in range(200)]
    spool.put_call(f'{{"kernel": null, "slices": {slices}}}')
    status = f"'{sys.executable}' -m radiosity_addon.farm status --tasks '{tmp_path}'"
    line = f"{status} | head -n 1; exit ${{PIPESTATUS[0]}}"
    ran = subprocess.run(
        ["bash", "-c", line], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
    )
    assert (ran.returncode, ran.stderr) == (0, "")
    assert ran.stdout.endswith("-0\n")


def test_status_says_how_far_the_bake_is(tmp_path: Path) -> None:
    spool = Spool.to_bake(tmp_path)

    def status() -> str:
        words = [sys.executable, "-m", "radiosity_addon.farm", "status", str(tmp_path)]
        return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=60, check=True).stdout

    assert f"process {os.getpid()} on" in status()
    name = min(KERNELS)
    call = (
        f'{{"kernel": {{"partial": [{{"function": "{name}"}}, 1, 2]}}, "slices": [[0, 1], [1, 2], [2, 3]]}}'
    )
    digest = spool.put_call(call)
    spool.claim(digest, 0)
    spool.claim(digest, 1)
    spool.put_result(digest, 1, None, [])
    spool.put_array(np.arange(50_000.0))
    said = status()
    assert f"{name}: 1 of 3 tasks done, 1 begun" in said
    assert "0.4 MB of inputs, 0.0 MB of results" in said
    spool.close_call()
    said = status()
    assert "computes what is not shared" in said
    assert "0.4 MB of inputs" in said
    spool.leave()
    assert status().startswith("no bake goes on here")
    spool.end()
    assert "has ended" in status()
