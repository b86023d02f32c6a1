"""The command line's temporary files: its own folder, and nothing else, is removed at the end."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from radiosity_addon.publishing.marked_folders import OWNER_FILE, MarkedFolder
from tests.processes import run_python

ROOT = Path(__file__).resolve().parents[2]

OTHER = "radiosity-0123456789abcdef-12345678"
"""A folder with a name of ours that somebody else has made."""

posix = pytest.mark.skipif(os.name == "nt", reason="kills as POSIX does")

# A Blender that took TMPDIR itself for its folder, as it does where it cannot make one of its own.
RUN = """
import os, runpy, sys, types
app = types.SimpleNamespace(tempdir=os.environ.get("BLENDER_S") or os.environ["TMPDIR"])
sys.modules["bpy"] = types.SimpleNamespace(app=app)
if os.environ.get("NO_FOLDERS"):
    def refused(*_a, **_k):
        raise OSError(28, "No space left on device")
    os.mkdir = refused
sys.argv = ["radiosity_addon", "bake", "--help"]
runpy.run_module("radiosity_addon", run_name="__main__")
"""

KILLED = """
import os
from pathlib import Path
from radiosity_addon.cli.temporary_folder import TemporaryFolder
folder = TemporaryFolder()
assert os.environ["TMPDIR"] == os.environ["TEMP"] == str(folder.path)
(folder.path / "blender_abc").mkdir()
(folder.path / "blender_abc" / "quit.blend").write_text("x")
os.kill(os.getpid(), 9)
"""


def run(code: str, tmpdir: Path, **more: str) -> subprocess.CompletedProcess[str]:
    return run_python(code, TMPDIR=str(tmpdir), **more)


@pytest.mark.parametrize("no_folders", ["", "1"])
def test_the_folder_for_temporary_files_itself_is_never_removed(tmp_path: Path, no_folders: str) -> None:
    tmp_path = tmp_path / "tmp"
    (tmp_path / "radiosity-notes").mkdir(parents=True)
    (tmp_path / "radiosity-projects").mkdir()
    (tmp_path / "mine.txt").write_text("years of work")
    done = run(RUN, tmp_path, NO_FOLDERS=no_folders)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "mine.txt").read_text() == "years of work"
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "mine.txt",
        "radiosity-notes",
        "radiosity-projects",
    ]


@pytest.mark.parametrize("content", ["", "quit.blend"])
@pytest.mark.parametrize("name", ["blender_a1b2c3", "blender_mine"])
def test_blender_s_own_folder_is_removed_if_it_is_empty(tmp_path: Path, name: str, content: str) -> None:
    folder = tmp_path / name
    folder.mkdir()
    if content:
        (folder / content).write_text("x")
    done = run(RUN, tmp_path, NO_FOLDERS="1", BLENDER_S=f"{folder}{os.sep}")
    assert (done.returncode, done.stderr) == (0, "")
    assert folder.exists() == (name == "blender_mine" or content != "")


def test_an_empty_folder_that_blender_was_given_stays(tmp_path: Path) -> None:
    folder = tmp_path / "blender_abcdef"
    folder.mkdir()
    assert run(RUN, folder, NO_FOLDERS="1").returncode == 0
    assert folder.exists()


@posix
def test_what_a_kill_leaves_is_removed_at_the_next_start_alone(tmp_path: Path) -> None:
    (tmp_path / OTHER).mkdir()
    (tmp_path / OTHER / "mine.txt").write_text("of somebody else")
    assert run(KILLED, tmp_path).returncode == -signal.SIGKILL
    (left,) = [path for path in tmp_path.iterdir() if path.name != OTHER]
    assert (left / "blender_abc" / "quit.blend").exists()
    assert run(RUN, tmp_path).returncode == 0
    assert [path.name for path in tmp_path.iterdir()] == [OTHER]
    assert (tmp_path / OTHER / "mine.txt").exists()


def test_the_folder_of_a_living_process_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import tempfile

    from radiosity_addon.cli.temporary_folder import TemporaryFolder

    for name in ("TMPDIR", "TEMP", "TMP"):
        monkeypatch.setenv(name, str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    living = TemporaryFolder()
    assert living.path is not None
    (living.path / "file").write_text("in use")
    assert run(RUN, tmp_path).returncode == 0
    assert (living.path / "file").exists()
    # Replaced by something else meanwhile, it is not ours to remove.
    path = living.path
    path.rename(tmp_path / "moved")
    path.mkdir()
    (path / "mine.txt").write_text("mine")
    living.remove()
    assert (path / "mine.txt").exists()
    assert (tmp_path / "moved" / "file").exists()


def test_a_folder_loses_its_mark_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a kill leaves of a folder that is removed must be known as ours by the next start."""
    folder = MarkedFolder(tmp_path, "radiosity-")
    for name in ("blender_abc", "zzz"):
        (folder.path / name).mkdir()
        (folder.path / name / "quit.blend").write_text("x")
    removed: list[str] = []
    scandir = os.scandir

    def in_order(path: str) -> contextlib.AbstractContextManager[list[os.DirEntry[str]]]:
        with scandir(path) as entries:
            return contextlib.nullcontext(sorted(entries, key=lambda entry: entry.name))

    def noted(call: Callable[..., None]) -> Callable[..., None]:
        def run(path: object, **more: object) -> None:
            removed.append(Path(str(path)).name)
            call(path, **more)

        return run

    with monkeypatch.context() as patch:
        patch.setattr(os, "scandir", in_order)
        for name in ("unlink", "rmdir"):
            patch.setattr(os, name, noted(getattr(os, name)))
        folder.close()
    assert not folder.path.exists()
    assert removed[-2:] == [OWNER_FILE, folder.path.name]
