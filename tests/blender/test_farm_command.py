"""The preferences' Farm Command: the panel's bake is shared with what a command starts, and ends it."""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

from radiosity_addon.base import BakeError
from radiosity_addon.blender.jobs import farm
from radiosity_addon.blender.jobs.farm import ended_with, farm_of
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.blender.settings.preferences import Defaults, RADIOSITY_AP_preferences
from radiosity_addon.farm import FarmCommand, Spool, output_spool
from radiosity_addon.farm.farm_command import split
from radiosity_addon.options import BakeSettings
from tests.moments import until
from tests.processes import ROOT

pytestmark = pytest.mark.one_blender

WORKER = """
import json, os, sys
from pathlib import Path
Path(sys.argv[2]).open("a").write(json.dumps([os.getpid(), *sys.argv[1:]]) + "\\n")
sys.path.insert(0, sys.argv[3])
from radiosity_addon.farm import run_command
sys.exit(run_command(["worker", sys.argv[1]]))
"""


@pytest.fixture
def preferred(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> SimpleNamespace:
    """Preferences with a command that notes its words and works."""
    script = tmp_path / "my worker.py"
    script.write_text(WORKER)
    note = tmp_path / "note"
    command = f'"{sys.executable}" "{script}" {{spool}} "{note}" "{ROOT}"'
    chosen = SimpleNamespace(farm_command=command, spool_folder=str(tmp_path / "my spools"), note=note)
    (tmp_path / "my spools").mkdir()
    monkeypatch.setattr(farm, "preferences", lambda _context: chosen)
    return chosen


def report(folder: Path) -> dict:
    (path,) = folder.rglob("*_report.json")
    return json.loads(path.read_text())


def of_workers(folder: Path) -> list[str]:
    """Return the warnings about workers."""
    return [each["message"] for each in report(folder)["warnings"] if each["name"] == "workers"]


def wait_for_workers(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Leave each call's first task to workers; returns where the number of calls is counted."""
    put_call, calls = Spool.put_call, [0]

    def put(self: Spool, text: str) -> str:
        digest = put_call(self, text)
        calls[0] += 1
        until(lambda: self.claimed(digest) | self.done(digest))
        return digest

    monkeypatch.setattr(Spool, "put_call", put)
    return calls


def test_the_command_helps_once_and_is_gone(
    room: Path, preferred: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    bpy.context.scene.radiosity.resolution = 256
    spools = Path(preferred.spool_folder)
    command, preferred.farm_command = preferred.farm_command, ""
    bpy.ops.radiosity.bake()
    alone = {path.name: path.read_bytes() for path in room.rglob("*.exr")}
    assert "shared" not in report(room)["performance"]
    assert not preferred.note.exists()
    preferred.farm_command = command
    calls = wait_for_workers(monkeypatch)
    bpy.ops.radiosity.bake()
    assert calls[0] > 0
    assert {path.name: path.read_bytes() for path in room.rglob("*.exr")} == alone
    assert not of_workers(room)
    assert sum(entry["tasks_by_workers"] for entry in report(room)["performance"]["shared"]) > 0
    (line,) = preferred.note.read_text().splitlines()
    number, spool, *_ = json.loads(line)
    assert Path(spool).parent == spools
    assert list(spools.iterdir()) == []
    with pytest.raises(ProcessLookupError):
        os.kill(number, 0)


@pytest.mark.parametrize("empty", ["farm_command", "spool_folder"])
def test_one_without_the_other_shares_nothing(empty: str, preferred: SimpleNamespace) -> None:
    setattr(preferred, empty, "  ")
    assert farm_of(bpy.context) == (None, None)


def test_a_relative_folder_is_refused(preferred: SimpleNamespace) -> None:
    for folder in ("//spools", "spools"):
        preferred.spool_folder = folder
        with pytest.raises(BakeError, match="give the whole path"):
            farm_of(bpy.context)


def test_a_folder_that_is_not_there_is_refused(preferred: SimpleNamespace, tmp_path: Path) -> None:
    """A share that is not mounted: its name would be that of a folder on this machine."""
    (tmp_path / "file").write_text("mine")
    for name in ("gone", "file", "file/below"):
        preferred.spool_folder = str(tmp_path / name)
        with pytest.raises(BakeError, match="is no folder: make it, or mount it"):
            farm_of(bpy.context)
    assert not (tmp_path / "gone").exists()


def test_where_no_spool_can_be_made_the_bake_goes_on_alone(
    room: Path, preferred: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    to_bake = Spool.to_bake

    def full(path: Path, made_for: Path | None = None) -> Spool:
        to_bake(path, made_for)
        raise BakeError("cannot write to spool")

    monkeypatch.setattr(Spool, "to_bake", full)
    assert bpy.ops.radiosity.bake() == {"FINISHED"}
    assert of_workers(room) == ["cannot write to spool; the bake went on alone"]
    assert list(Path(preferred.spool_folder).iterdir()) == []
    assert not preferred.note.exists()


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ("/no/such/program {spool}", "cannot be started: No such file or directory; the bake went on alone"),
        ('sleep "5', "cannot be started: No closing quotation; the bake went on alone"),
        (f"{sys.executable} -c \"import sys; sys.exit('no licence')\"", "failed: no licence"),
        (f'{sys.executable} -c "import sys; sys.exit(3)"', "failed: exit code 3"),
        (f'{sys.executable} -c "pass"', ""),
    ],
)
def test_a_command_that_fails_is_a_warning(
    command: str, says: str, room: Path, preferred: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    preferred.farm_command = command
    start = FarmCommand.start

    def start_and_wait(self: FarmCommand, spool: Spool) -> None:
        start(self, spool)
        until(lambda: self.process is None or self.process.code is not None)

    monkeypatch.setattr(FarmCommand, "start", start_and_wait)
    assert bpy.ops.radiosity.bake() == {"FINISHED"}
    assert of_workers(room) == ([f"the farm command {says}"] if says else [])
    assert list(Path(preferred.spool_folder).iterdir()) == []


def test_canceling_ends_the_command(
    room: Path, preferred: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in a window: the thread of the bake still is at its work then."""
    go, waits = [False], [False]
    put_call = Spool.put_call

    def put(self: Spool, text: str) -> str:
        digest = put_call(self, text)
        waits[0] = True
        until(lambda: go[0])
        return digest

    monkeypatch.setattr(Spool, "put_call", put)
    command, baking = farm_of(bpy.context)
    assert command is not None
    settings = BakeSettings(resolution=256, quality="sketch")
    job = ended_with(
        run_bake(bpy.context, settings, None, in_background=True, baking=baking), command
    )
    while not (waits[0] and preferred.note.exists()):
        next(job)
    number = json.loads(preferred.note.read_text())[0]
    os.kill(number, 0)
    job.close()
    with pytest.raises(ProcessLookupError):
        os.kill(number, 0)
    # When it is through with its step, the thread takes the spool away.
    spools = Path(preferred.spool_folder)
    assert len(list(spools.iterdir())) == 1
    go[0] = True
    until(lambda: not list(spools.iterdir()))


def test_a_bake_that_ends_first_starts_nothing(preferred: SimpleNamespace, tmp_path: Path) -> None:
    command = FarmCommand(preferred.farm_command)
    command.end()
    command.start(Spool.to_bake(tmp_path / "spool"))
    assert command.process is None


def test_spools_of_bakes_that_were_killed_go_after_a_day(
    preferred: SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Path(preferred.spool_folder)
    names = [f"radiosity-{digit * 16}" for digit in "0123456"]
    old, new, foreign, renamed, mixed, empty, linked = (folder / name for name in names)
    for path in (old, new, renamed, mixed):
        Spool.to_bake(path, made_for=folder).put_call("{}")
    Spool.to_bake(foreign).put_call("{}")
    renamed.rename(folder / "mine")
    (mixed / "thesis.txt").write_text("mine")
    empty.mkdir()
    Spool.to_bake(tmp_path / "elsewhere", made_for=folder)
    linked.symlink_to(tmp_path / "elsewhere")
    long_ago = time.time() - 2 * output_spool.FORGOTTEN
    for path in (old, foreign, folder / "mine", mixed, tmp_path / "elsewhere"):
        os.utime(path / "baking", (long_ago, long_ago))
    with output_spool.shared_in_folder(folder, FarmCommand("")):
        assert not old.exists()
    left = [new.name, foreign.name, mixed.name, empty.name, linked.name, "mine"]
    assert sorted(path.name for path in folder.iterdir()) == sorted(left)
    assert [path.name for path in mixed.iterdir()] == ["thesis.txt"]
    assert (tmp_path / "elsewhere" / "spool.json").exists()


def test_words_are_split_as_a_shell_would() -> None:
    line = r'''ssh -p 22 "my host" 'run it' a\ b "{spool}/x" # all'''
    assert split(line, windows=False) == [
        "ssh", "-p", "22", "my host", "run it", "a b", "{spool}/x", "#", "all",
    ]  # fmt: skip
    line = r'"C:\Program Files\Blender\blender.exe" -b --command radiosity worker {spool} \\nas\it''s'
    assert split(line, windows=True) == [
        r"C:\Program Files\Blender\blender.exe", "-b", "--command", "radiosity", "worker", "{spool}",
        r"\\nas\its",
    ]  # fmt: skip
    assert split("", windows=False) == []


def test_the_preferences_are_empty_at_first(registered: None) -> None:
    assert farm_of(bpy.context) == (None, None)
    made = RADIOSITY_AP_preferences.bl_rna.properties
    for name in ("farm_command", "spool_folder"):
        assert made[name].default == getattr(Defaults, name) == ""
