"""What is left of a bake that was killed: nothing of its own, and the earlier result whole."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.files.baked_files import digest_of_file
from radiosity_addon.publishing import publish as staging_module
from radiosity_addon.publishing.marked_folders import OWNER_FILE
from radiosity_addon.publishing.publish import (
    EARLIER,
    JOURNAL,
    PREFIX,
    Staging,
    clean_up,
    is_interrupted,
    replacing,
)

ROOT = Path(__file__).resolve().parents[2]
OURS = "0123456789abcdef-abcd1234"
"""What follows the prefix in the name of a folder of ours."""

A, B, C = "a.exr", "b.exr", "c.exr"

KILLED = """
import os, sys
from pathlib import Path
from radiosity_addon.publishing.publish import Staging

target, after = Path(sys.argv[1]), int(sys.argv[2])
staging = Staging(target)
staging.aside.write_text("new")
for name in ("a.exr", "b.exr", "c.exr"):
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
    """The files of a folder that are not hidden."""
    return {
        path.name: path.read_text() for path in folder.iterdir() if path.is_file() and path.name[0] != "."
    }


def staging_folders(folder: Path) -> list[Path]:
    return [path for path in folder.glob(f"{PREFIX}*") if path.is_dir()]


posix = pytest.mark.skipif(os.name == "nt", reason="kills as POSIX does")


@posix
@pytest.mark.parametrize("after", [-1, 0, 1, 2, 3])
def test_a_killed_bake_leaves_the_earlier_files_or_the_new_ones_whole(tmp_path: Path, after: int) -> None:
    earlier = {A: "old", C: "old", "mine": "keep"}
    for name, text in earlier.items():
        (tmp_path / name).write_text(text)
    killed(tmp_path, after)
    assert len(staging_folders(tmp_path)) == 1
    # Never torn, even before anybody looks; and looking changes nothing.
    seen = contents(tmp_path)
    assert set(seen.values()) <= {"old", "new", "keep"}
    assert is_interrupted(tmp_path) == (0 < after < 3)
    assert contents(tmp_path) == seen
    assert clean_up(tmp_path) == (0 < after < 3)
    assert contents(tmp_path) == (earlier if after < 3 else {**earlier, A: "new", B: "new", C: "new"})
    assert not list(tmp_path.glob(".*"))
    assert not clean_up(tmp_path)


def test_a_bake_that_goes_on_is_left_alone(tmp_path: Path) -> None:
    staging = Staging(tmp_path)
    (staging.path / A).write_text("new")
    staging.aside.write_text("new")
    clean_up(tmp_path)
    assert (staging.path / A).read_text() == "new"
    assert staging.aside.exists()
    staging.publish([A])
    staging.close()
    assert contents(tmp_path) == {A: "new"}
    assert not list(tmp_path.glob(".*"))


def test_folders_without_our_mark_are_left_alone(tmp_path: Path) -> None:
    mine = tmp_path / f"{PREFIX}notes"
    (mine / EARLIER).mkdir(parents=True)
    (mine / JOURNAL).write_text('{"names": ["thesis"]}')
    others = [tmp_path / f"{PREFIX}other", tmp_path / f"{PREFIX}{OURS}"]
    for other in others:
        other.mkdir()
        (other / OWNER_FILE).write_text("somebody else's mark")
    (tmp_path / "thesis").write_text("years of work")
    assert not clean_up(tmp_path)
    assert mine.exists()
    assert all(other.exists() for other in others)
    assert (tmp_path / "thesis").read_text() == "years of work"


def test_a_damaged_journal_takes_nothing_back_and_loses_nothing(tmp_path: Path) -> None:
    (tmp_path / A).write_text("old")
    killed(tmp_path, -1)
    (folder,) = staging_folders(tmp_path)
    (folder / JOURNAL).write_text("{")
    assert not clean_up(tmp_path)
    assert contents(tmp_path) == {A: "old"}
    assert staging_folders(tmp_path) == [folder]


def crafted(target: Path, files: dict[str, dict], kept: dict[str, str]) -> Path:
    """A staging folder as somebody may send it: with our mark, a journal and files that it keeps."""
    staging = Staging(target)
    staging.release()
    (staging.path / EARLIER).mkdir()
    for name, text in kept.items():
        (staging.path / EARLIER / name).write_text(text)
    # The first format's journal, and this one's.
    told = {"version": 2, "names": list(files), "files": files}
    (staging.path / JOURNAL).write_text(json.dumps(told))
    return staging.path


NAMES = [
    "../victim.exr",
    "victim",
    "/victim.exr",
    ".victim.exr",
    "..",
    "",
    "sub/victim.exr",
    "..\\victim.exr",
]


@pytest.mark.parametrize("name", NAMES)
def test_a_journal_that_names_what_no_bake_writes_touches_nothing(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "folder"
    (folder / "sub").mkdir(parents=True)
    victims = [
        tmp_path / "victim.exr",
        folder / "victim",
        folder / "sub" / "victim.exr",
        folder / ".victim.exr",
    ]
    for victim in victims:
        victim.write_text("years of work")
    known = digest_of_file(victims[0])
    made = crafted(folder, {name: {"new": known, "old": None}}, {})
    assert not is_interrupted(folder)
    assert not clean_up(folder)
    assert all(victim.read_text() == "years of work" for victim in victims)
    assert made.exists()


@posix
def test_a_journal_touches_only_regular_files_of_known_content(tmp_path: Path) -> None:
    victim, folder = tmp_path / "victim.exr", tmp_path / "folder"
    folder.mkdir()
    victim.write_text("years of work")
    known = digest_of_file(victim)
    (folder / "link.exr").symlink_to(victim)
    (folder / "other.exr").write_text("mine")
    crafted(folder, {"link.exr": {"new": known, "old": None}, "other.exr": {"new": known, "old": None}}, {})
    assert not clean_up(folder)
    assert victim.read_text() == "years of work"
    assert (folder / "link.exr").is_symlink()
    assert (folder / "other.exr").read_text() == "mine"


@posix
@pytest.mark.parametrize("what", ["mark", "earlier", "kept", "folder"])
def test_links_in_a_staging_folder_are_not_followed(tmp_path: Path, what: str) -> None:
    elsewhere, folder = tmp_path / "elsewhere", tmp_path / "folder"
    elsewhere.mkdir()
    folder.mkdir()
    (elsewhere / A).write_text("secret")
    (folder / A).write_text("new")
    files = {A: {"new": digest_of_file(folder / A), "old": digest_of_file(elsewhere / A)}}
    made = crafted(folder, files, {A: "secret"})
    if what == "mark":
        (made / OWNER_FILE).rename(elsewhere / "mark")
        (made / OWNER_FILE).symlink_to(elsewhere / "mark")
    elif what == "earlier":
        (made / EARLIER / A).unlink()
        (made / EARLIER).rmdir()
        (made / EARLIER).symlink_to(elsewhere)
    elif what == "kept":
        (made / EARLIER / A).unlink()
        (made / EARLIER / A).symlink_to(elsewhere / A)
    else:
        made.rename(elsewhere / made.name)
        made.symlink_to(elsewhere / made.name)
    assert not clean_up(folder)
    assert (folder / A).read_text() == "new"
    assert (elsewhere / A).read_text() == "secret"


@posix
def test_a_file_changed_after_the_kill_stops_the_recovery_and_is_named(tmp_path: Path) -> None:
    for name in (A, B, C):
        (tmp_path / name).write_text("old")
    killed(tmp_path, 2)
    (tmp_path / B).write_text("painted on")
    before = contents(tmp_path)
    assert is_interrupted(tmp_path)
    with pytest.raises(BakeError, match=r"b\.exr"):
        clean_up(tmp_path)
    assert contents(tmp_path) == before
    (tmp_path / B).rename(tmp_path / "painted")
    assert clean_up(tmp_path)
    assert contents(tmp_path) == {A: "old", B: "old", C: "old", "painted": "painted on"}


@posix
def test_a_recovery_can_be_killed_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (A, B, C):
        (tmp_path / name).write_text("old")
    killed(tmp_path, 3 - 1)
    rename, count = staging_module.rename, 0

    def once(source: Path, target: Path) -> None:
        nonlocal count
        count += 1
        if count == 2:
            raise KeyboardInterrupt
        rename(source, target)

    monkeypatch.setattr(staging_module, "rename", once)
    with pytest.raises(KeyboardInterrupt):
        clean_up(tmp_path)
    monkeypatch.setattr(staging_module, "rename", rename)
    clean_up(tmp_path)
    assert contents(tmp_path) == {A: "old", B: "old", C: "old"}
    assert not list(tmp_path.glob(".*"))


def test_what_cannot_be_put_back_now_is_put_back_by_the_next_bake(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A disk that fails while files are renamed fails while they are renamed back."""
    for name in (A, B):
        (tmp_path / name).write_text("old")
    staging = Staging(tmp_path)
    for name in (A, B):
        (staging.path / name).write_text("new")
    rename, count = staging_module.rename, 0

    def failing(source: Path, target: Path) -> None:
        nonlocal count
        count += target.parent == tmp_path
        if count > 1:
            raise OSError(errno.EIO, "Input/output error", str(source))
        rename(source, target)

    monkeypatch.setattr(staging_module, "rename", failing)
    with pytest.raises(OSError, match="Input") as caught:
        staging.publish([A, B])
    assert caught.value.filename == str(tmp_path / B)
    staging.close()
    monkeypatch.setattr(staging_module, "rename", rename)
    assert contents(tmp_path) == {A: "new", B: "old"}
    assert clean_up(tmp_path)
    assert contents(tmp_path) == {A: "old", B: "old"}


def test_a_file_that_appears_while_publishing_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    staging = Staging(tmp_path)
    (staging.path / A).write_text("new")
    write = staging_module.write_journal

    def and_somebody_else(*given: object) -> None:
        write(*given)
        (tmp_path / A).write_text("mine")

    monkeypatch.setattr(staging_module, "write_journal", and_somebody_else)
    with pytest.raises(BakeError, match=r"a\.exr"):
        staging.publish([A])
    staging.close()
    assert contents(tmp_path) == {A: "mine"}
    assert not list(tmp_path.glob(".*"))


def test_what_kills_leave_half_made_is_removed(tmp_path: Path) -> None:
    empty, marked = tmp_path / f"{PREFIX}{OURS}", tmp_path / f"{PREFIX}{OURS[:-1]}5"
    empty.mkdir()
    marked.mkdir()
    (marked / OWNER_FILE).touch()
    clean_up(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["projects", "12345678", "versions-abcd1234"])
def test_an_empty_folder_that_somebody_else_made_stays(tmp_path: Path, name: str) -> None:
    """A word of eight letters looks like what `tempfile` adds to a prefix."""
    (tmp_path / f"{PREFIX}{name}").mkdir()
    clean_up(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [f"{PREFIX}{name}"]


def test_a_single_file_is_replaced_as_a_whole_or_not(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError), replacing(path) as aside:  # noqa: PT012
        aside.write_text("ne")
        raise ZeroDivisionError
    assert contents(tmp_path) == {"r.json": "old"}
    with replacing(path) as aside:
        aside.write_text("new")
        assert path.read_text() == "old"
    assert contents(tmp_path) == {"r.json": "new"}
    assert not list(tmp_path.glob(".*"))
