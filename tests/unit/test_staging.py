"""What is left of a bake that was killed: nothing of its own, and the earlier result whole."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from radiosity_addon.staging import EARLIER, JOURNAL, MARK, PREFIX, Staging, clean_up

ROOT = Path(__file__).resolve().parents[2]

KILLED = """
import os, sys
from pathlib import Path
from radiosity_addon.staging import Staging

target, after = Path(sys.argv[1]), int(sys.argv[2])
staging = Staging(target)
for name in ("a", "b", "c"):
    (staging.path / name).write_text("new")
replace, count = Path.replace, 0

def replacing(source, goal):
    global count
    if goal.parent == target:
        if count == after:
            os.kill(os.getpid(), 9)
        count += 1
    return replace(source, goal)

if after < 0:
    os.kill(os.getpid(), 9)
Path.replace = replacing
staging.publish(staging.names())
os.kill(os.getpid(), 9)
"""


def killed(target: Path, after: int) -> None:
    """Publish in a process that is killed after so many files were renamed; -1: before, 3: after all."""
    done = subprocess.run(
        [sys.executable, "-c", KILLED, str(target), str(after)], cwd=ROOT, timeout=60, check=False
    )
    assert done.returncode != 0


def contents(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.iterdir() if path.is_file()}


def staging_folders(folder: Path) -> list[Path]:
    return list(folder.glob(f"{PREFIX}*"))


@pytest.mark.skipif(os.name == "nt", reason="kills as POSIX does")
@pytest.mark.parametrize("after", [-1, 0, 1, 2, 3])
def test_a_killed_bake_leaves_the_earlier_files_or_the_new_ones_whole(tmp_path: Path, after: int) -> None:
    earlier = {"a": "old", "c": "old", "mine": "keep"}
    for name, text in earlier.items():
        (tmp_path / name).write_text(text)
    killed(tmp_path, after)
    assert len(staging_folders(tmp_path)) == 1
    # Never torn, even before anybody looks.
    assert set(contents(tmp_path).values()) <= {"old", "new", "keep"}
    assert clean_up(tmp_path) == (0 <= after < 3)
    assert contents(tmp_path) == (earlier if after < 3 else {**earlier, "a": "new", "b": "new", "c": "new"})
    assert staging_folders(tmp_path) == []
    assert not clean_up(tmp_path)


def test_a_bake_that_goes_on_is_left_alone(tmp_path: Path) -> None:
    staging = Staging(tmp_path)
    (staging.path / "a").write_text("new")
    clean_up(tmp_path)
    assert (staging.path / "a").read_text() == "new"
    staging.publish(["a"])
    staging.close()
    assert contents(tmp_path) == {"a": "new"}
    assert staging_folders(tmp_path) == []


def test_folders_without_our_mark_are_left_alone(tmp_path: Path) -> None:
    mine = tmp_path / f"{PREFIX}notes"
    (mine / EARLIER).mkdir(parents=True)
    (mine / JOURNAL).write_text('{"names": ["thesis"]}')
    other = tmp_path / f"{PREFIX}other"
    other.mkdir()
    (other / MARK).write_text("somebody else's mark")
    (tmp_path / "thesis").write_text("years of work")
    assert not clean_up(tmp_path)
    assert mine.exists()
    assert other.exists()
    assert (tmp_path / "thesis").read_text() == "years of work"


def test_a_damaged_journal_takes_nothing_back_and_loses_nothing(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("old")
    killed(tmp_path, -1)
    (folder,) = staging_folders(tmp_path)
    (folder / JOURNAL).write_text("{")
    assert not clean_up(tmp_path)
    assert contents(tmp_path) == {"a": "old"}
    assert staging_folders(tmp_path) == [folder]
