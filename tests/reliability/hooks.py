"""Python's audit events of file system calls: to make a call fail, or to end the process before it.

Whatever module makes the call, and however it is written, the event comes first. A hook cannot be taken out
again; it is idle while `Watch.active` is False.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path

PATHS = {
    "open": (0,), "os.rename": (0, 1), "os.link": (0, 1), "os.symlink": (0, 1), "os.remove": (0,),
    "os.mkdir": (0,), "os.rmdir": (0,), "os.listdir": (0,), "os.scandir": (0,), "os.chmod": (0,),
    "os.utime": (0,), "os.truncate": (0,), "shutil.rmtree": (0,), "shutil.move": (0, 1),
    "shutil.copyfile": (0, 1), "shutil.copytree": (0, 1), "tempfile.mkdtemp": (0,), "tempfile.mkstemp": (0,),
}  # fmt: skip
"""Where the paths of an event are among its arguments."""

BY_NUMBER = {"os.fsync", "fcntl.flock"}
"""Events of open files, which have no path."""

DIRECTORY = {"os.remove": 1, "os.rmdir": 1, "os.mkdir": 2}
"""Where an event says relative to what its path is: -1 is the working directory."""


class Watch:
    """Calls `react(event, paths)` before each call that concerns a folder, and counts them."""

    def __init__(self, react: Callable[[int, str, list[str]], None], *folders: Path) -> None:
        self.active, self.count = False, 0
        self._react = react
        self._folders = tuple(f"{folder}{os.sep}" for folder in folders)
        self._busy = threading.local()
        fsync = os.fsync

        def audited(number: int) -> None:
            sys.audit("os.fsync", number)
            fsync(number)

        os.fsync = audited  # type: ignore[assignment]
        sys.addaudithook(self._hook)

    def _hook(self, event: str, given: tuple) -> None:
        if not self.active or (event not in PATHS and event not in BY_NUMBER):
            return
        if getattr(self._busy, "now", False):
            return
        paths = [_text(given[place]) for place in PATHS.get(event, ()) if place < len(given)]
        if not (event in BY_NUMBER or self._concerns(event, given, paths)):
            return
        self._busy.now = True
        try:
            self.count += 1
            self._react(self.count, event, paths)
        finally:
            self._busy.now = False

    def _concerns(self, event: str, given: tuple, paths: list[str]) -> bool:
        place = DIRECTORY.get(event)
        if place is not None and place < len(given) and given[place] not in (-1, None):
            return True
        return any(f"{path}{os.sep}".startswith(self._folders) for path in paths)


def _text(path: object) -> str:
    try:
        return os.fsdecode(path)  # type: ignore[arg-type]
    except TypeError:
        return ""


def kill_at(number: int, *folders: str) -> None:
    """End this process, and all of its group, before its call number `number` that concerns the folders."""

    def react(count: int, _event: str, _paths: list[str]) -> None:
        if count == number:
            os.killpg(0, signal.SIGKILL)

    Watch(react, *map(Path, folders)).active = True


def count_into(file: str, *folders: str) -> None:
    """Write a line into a file for each call that concerns the folders."""
    log = open(file, "a", encoding="utf-8", buffering=1)  # noqa: PTH123, SIM115 (as long as the process lives)

    def react(count: int, event: str, paths: list[str]) -> None:
        log.write(f"{count} {event} {paths}\n")

    Watch(react, *map(Path, folders)).active = True
