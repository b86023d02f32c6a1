"""The folder that the processes of one bake share.

    spool.json               what it is, and which program may work in it
    arrays/DIGEST.npy        arrays that kernels read
    objects/DIGEST.json      objects that they read
    calls/DIGEST/call.json   a kernel, what it reads, and its slices
    calls/DIGEST/N.claim     some process is at task N: a few slices
    calls/DIGEST/N.result    what the task found
    open                     the digest of the call that waits for its tasks
    baking                   which process bakes
    over                     the bake has ended
    prepared                 the digest of the bake that was prepared (`prepared.py`), as an object
    begun                    the digest of the inputs that were baked last
    results/DIGEST           the digest of what a bake of these inputs found (`stored_result.py`)
    finished                 the folder that the prepared bake was finished into

Everything is written aside and renamed, and checked by its digest when it is read: what is not whole is
found, and made again, so nothing has to be synced. Running a task twice does no harm, so nothing is locked.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..base import BakeError
from ..numerics import ArrayFileError, read_arrays, write_arrays
from .identity import identity
from .objects import ObjectError, digest_of
from .signs import refuse_second_bake, take_away, this_process
from .spool_store import Array, SpoolStore, explained, is_own, linked, not_written

MAGIC, FORMAT = b"RADIOSITYTASK", 1
KIND = "radiosity spool"

RECORD, PREPARED, BEGUN, FINISHED = "spool.json", "prepared", "begun", "finished"

_FOLDERS = ("arrays", "objects", "calls", "results", "aside")
_OURS = re.compile(
    r"(arrays/[0-9a-f]{40}\.npy|objects/[0-9a-f]{40}\.json|calls/[0-9a-f]{40}/(call\.json|\d+\.(claim|result))"
    r"|results/[0-9a-f]{40}|aside/[0-9a-f]{32}|\.[0-9a-f]{32})"
)


class Spool(SpoolStore):
    """A spool that exists, or is made."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.sign = self.path / "baking"

    @classmethod
    def to_bake(cls, path: Path, made_for: Path | None = None) -> Spool:
        """Return a spool that this process bakes with, made if it is not there.

        made_for: The output folder of the bake that makes the spool for itself.
        Raises BakeError as `made` does.
        """
        spool = cls.made(path, made_for)
        spool.reopen()
        spool.take()
        return spool

    @classmethod
    def made(cls, path: Path, made_for: Path | None = None) -> Spool:
        """Return a new spool in an empty folder, or one of this program that no bake goes on in.

        Raises BakeError if the folder holds other things, another bake uses it, or it cannot be written to.
        """
        spool = cls(path)
        with explained(spool.path):
            if spool.path.exists() and not spool.path.is_dir():
                raise BakeError(f"'{spool.path}' is no folder: give an empty folder")
            spool.path.mkdir(parents=True, exist_ok=True)
            record = spool.path / RECORD
            if not record.exists():
                # A bake that was killed at its start may have left what it was writing.
                if not all(_OURS.fullmatch(path.name) for path in spool.path.iterdir()):
                    raise BakeError(f"'{spool.path}' is not empty and no spool: give an empty folder")
                made = {} if made_for is None else {"made_for": str(made_for)}
                spool._write(record, json.dumps({"kind": KIND, "program": identity(), **made}).encode())
            spool.check()
            refuse_second_bake(spool.sign)
            for name in _FOLDERS:
                (spool.path / name).mkdir(exist_ok=True)
        return spool

    def take(self) -> None:
        """Show that this process works at the bake: others are refused until it leaves."""
        self._write(self.sign, this_process().encode())

    def reopen(self) -> None:
        """Have workers wait for the bake again, which has ended."""
        with explained(self.path), contextlib.suppress(FileNotFoundError):
            (self.path / "over").unlink()

    @classmethod
    def of_output(cls, path: Path, output: Path) -> Spool:
        """Return the spool that a bake makes for itself, or that an earlier bake into its folder has left.

        Raises BakeError if something else has its name, or as `to_bake` does.
        """
        with explained(path):
            if path.is_symlink() or (path.exists() and not cls(path)._is_free_for(output)):
                raise BakeError(
                    f"'{path}' is in the way of the bake's spool: rename it, or give a folder with --spool"
                )
        return cls.to_bake(path, output)

    def _is_free_for(self, output: Path) -> bool:
        """Return whether the folder is empty, or the spool of bakes into `output`.

        One that another version of the program has left is removed.
        """
        record = self._record()
        if record is None:
            return self.path.is_dir() and all(_OURS.fullmatch(path.name) for path in self.path.iterdir())
        if not self.is_made_for(output) or self.is_prepared():
            return False
        refuse_second_bake(self.sign)
        if record.get("program") != identity():
            self.remove()
        return True

    def is_made_for(self, folder: Path) -> bool:
        """Return whether a bake has made the spool for itself and this folder."""
        record = self._record()
        return record is not None and record.get("made_for") == str(folder)

    def last_sign(self) -> float:
        """Return when a bake was last known to go on here [s since 1970]. Raises OSError if none ever was."""
        sign = self.sign if self.sign.exists() else self.path / RECORD
        return sign.stat().st_mtime

    @classmethod
    def to_work(cls, path: Path) -> Spool:
        """Return a spool that a bake has made. Raises BakeError if there is none, or of another program."""
        spool = cls(path)
        spool.check()
        return spool

    def check(self) -> None:
        """Refuse what is no spool, or one of another program: its bytes would differ."""
        path, record = self.path / RECORD, self._record()
        if record is None:
            if path.exists() or all((self.path / name).is_dir() for name in _FOLDERS):
                what = "damaged" if path.exists() else "gone"
                raise BakeError(f"'{path}' is {what}: start or prepare the bake again, in an empty folder")
            raise BakeError(f"'{self.path}' is no spool; start the bake first, with --spool")
        for name in _FOLDERS:
            if (self.path / name).is_symlink():
                raise linked(self.path / name)
        theirs, ours = record.get("program"), identity()
        if not isinstance(theirs, dict) or theirs != ours:
            theirs = theirs if isinstance(theirs, dict) else {}
            differing = [name for name in ours if theirs.get(name) != ours[name]]
            name = differing[0] if differing else "program"
            raise BakeError(
                f"spool '{self.path}' is of another {name} ({theirs.get(name, 'unknown')}, here "
                f"{ours.get(name)}): the lightmap would not be the same bytes; use one version on machines "
                "of one kind"
            )

    def _record(self) -> dict[str, Any] | None:
        """Return what a spool says of itself; None if that is not there or damaged."""
        try:
            record = json.loads(self._read(self.path / RECORD))
        except (ValueError, RecursionError):  # ObjectError among them
            return None
        return record if isinstance(record, dict) and record.get("kind") == KIND else None

    def is_prepared(self) -> bool:
        """Return whether the bake was prepared: its inputs, and then its result, are needed after it."""
        return (self.path / PREPARED).exists()

    # Calls and tasks

    def put_call(self, text: str) -> str:
        """Write a call, and show it as the one that waits; return its digest."""
        digest = digest_of(text)
        folder = self._at("calls", digest)
        if folder.parent.is_symlink():
            raise linked(folder.parent)
        with explained(self.path):
            if folder.is_symlink():
                folder.unlink()
            folder.mkdir(exist_ok=True)
            self._keep(folder / "call.json", text.encode())
            # Whoever made claims in an earlier run may be gone.
            for claim in folder.glob("*.claim"):
                with contextlib.suppress(OSError):
                    claim.unlink()
        self.point("open", digest)
        return digest

    def open_call(self) -> str | None:
        """Return the digest of the call that waits for its tasks, if there is one."""
        return self.pointer("open")

    def call(self, digest: str) -> Any:
        """Return a call. Raises ObjectError if it is damaged, or a link out of the spool."""
        folder = self._at("calls", digest)
        text = self._read(folder / "call.json").decode(errors="replace")
        if folder.is_symlink() or digest_of(text) != digest:
            raise ObjectError(f"call {digest} is damaged")
        try:
            return json.loads(text)
        except (ValueError, RecursionError) as error:
            raise ObjectError(f"call {digest}: {error}") from error

    def close_call(self) -> None:
        """Show no call as waiting."""
        with contextlib.suppress(OSError):
            (self.path / "open").unlink()

    def claim(self, digest: str, task: int) -> bool:
        """Return whether a task was free, and is now claimed."""
        try:
            with (self._at("calls", digest) / f"{task}.claim").open("x") as file:
                file.write(this_process())
        except FileExistsError:
            return False
        except OSError as error:
            raise not_written(self.path, error) from error
        return True

    def done(self, digest: str) -> set[int]:
        """Return the tasks of a call that have results."""
        return {int(name.stem) for name in self._tasks(digest, ".result")}

    def claimed(self, digest: str) -> set[int]:
        """Return the tasks of a call that are claimed."""
        return {int(name.stem) for name in self._tasks(digest, ".claim")}

    def _tasks(self, digest: str, suffix: str) -> Iterator[Path]:
        with contextlib.suppress(OSError):
            for path in self._at("calls", digest).iterdir():
                if path.suffix == suffix and path.stem.isdecimal():
                    yield path

    def put_result(self, digest: str, task: int, tree: Any, arrays: list[Array]) -> None:
        """Write what a task found."""
        with self._replacing(self._at("calls", digest) / f"{task}.result") as aside:
            write_arrays(aside, MAGIC, FORMAT, tree, arrays, level=0)

    def result(self, digest: str, task: int) -> tuple[Any, list[Array]] | None:
        """Return what a task found; None, with the file removed, if it is damaged."""
        path = self._at("calls", digest) / f"{task}.result"
        try:
            if os.path.lexists(path) and not is_own(path):
                raise ArrayFileError("it is no file of ours")
            return read_arrays(path, MAGIC, FORMAT)
        except FileNotFoundError:
            return None
        except ArrayFileError:
            with contextlib.suppress(OSError):
                path.unlink()
            return None
        except OSError as error:
            raise BakeError(f"cannot read '{path}': {error.strerror}") from error

    def has_results(self) -> bool:
        """Return whether there is anything that a bake can go on with."""
        with contextlib.suppress(OSError):
            return any(self.path.glob("calls/*/*.result"))
        return False  # it is being emptied

    def say_over(self) -> None:
        """Tell all workers that the bake has ended."""
        self._write(self.path / "over", b"")
        self.close_call()

    def result_bytes(self, digest: str, task: int) -> int:
        """Return the size of a result's file."""
        with contextlib.suppress(OSError):
            return (self._at("calls", digest) / f"{task}.result").stat().st_size
        return 0

    def note(self, name: str, text: str) -> None:
        """Write a short text for other processes."""
        self._write(self.path / name, text.encode())

    def end(self) -> None:
        """Tell all workers that the bake has ended, and remove what it left."""
        self.say_over()
        self._empty()

    def _empty(self) -> None:
        """Remove what bakes left."""
        self.leave()
        left = [path for path in self.path.glob(".*") if path.is_file()]
        for folder in (self.path / name for name in _FOLDERS):
            if not folder.is_symlink():
                left += [folder, *folder.rglob("*")]
        # Deepest first; what others put there stays, and the folders around it.
        for path in sorted(left, reverse=True):
            with contextlib.suppress(OSError):
                if path.is_dir():
                    path.rmdir()
                elif _OURS.fullmatch(path.relative_to(self.path).as_posix()):
                    path.unlink()

    def remove(self) -> None:
        """Remove the spool with all that we wrote; the folder stays if it holds anything else."""
        with contextlib.suppress(OSError, BakeError):
            self.say_over()  # as long as the disk is not full
        with contextlib.suppress(OSError):
            self._empty()
        for name in ("open", "baking", "over", PREPARED, BEGUN, FINISHED, RECORD):
            with contextlib.suppress(OSError):
                (self.path / name).unlink()
        with contextlib.suppress(OSError):
            self.path.rmdir()

    def leave(self) -> None:
        """Take the sign away that a bake goes on here: another may go on with it at once."""
        take_away(self.sign)

    def is_over(self) -> bool:
        """Return whether the bake has ended."""
        return (self.path / "over").exists() or not (self.path / RECORD).exists()
