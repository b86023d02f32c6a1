"""Signs of life: which process bakes through a spool, and whether it still does.

The file `baking` holds that process; its time of change is renewed as long as the bake goes on.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Event, Thread

from ..base import BakeError

SILENCE = 60.0
"""Seconds after which a bake that gave no sign is gone."""


def this_process() -> str:
    """Return this machine's name and the number of this process."""
    return f"{socket.gethostname()} {os.getpid()}"


def is_alive(number: int) -> bool:
    """Return whether a process of this machine runs."""
    if sys.platform == "win32":
        return False  # to send signal 0 there would end it
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass  # somebody else's
    return True


def baker(sign: Path) -> tuple[str, str] | None:
    """Return the machine and the number of the process that bakes through the spool of this sign."""
    try:
        host, number = sign.read_text().split()
        silence = time.time() - sign.stat().st_mtime
        asked = host == socket.gethostname() and sys.platform != "win32"
        alive = is_alive(int(number)) if asked else silence < SILENCE
    except (OSError, ValueError, OverflowError):
        return None
    return (host, number) if alive else None


def other_baker(sign: Path) -> tuple[str, str] | None:
    """Return the same, if it is not this process."""
    found = baker(sign)
    return None if found is None or " ".join(found) == this_process() else found


def refuse_second_bake(sign: Path) -> None:
    """Raise BakeError if another process bakes through the spool of this sign."""
    other = other_baker(sign)
    if other is not None:
        host, number = other
        raise BakeError(
            f"spool '{sign.parent}' is used by process {number} on {host}: give each bake its own "
            f"(if that is no bake, remove '{sign}')"
        )


@contextlib.contextmanager
def giving_signs(sign: Path) -> Iterator[None]:
    """Show other machines that the bake goes on, also through stages that are not shared."""
    over = Event()

    def give_signs() -> None:
        while not over.wait(SILENCE / 10):
            with contextlib.suppress(OSError):
                os.utime(sign)

    giver = Thread(target=give_signs, daemon=True)
    giver.start()
    try:
        yield
    finally:
        over.set()
        giver.join()


def take_away(sign: Path) -> None:
    """Remove this process's sign: another may go on with its bake at once."""
    with contextlib.suppress(OSError):
        if sign.read_text() == this_process():
            sign.unlink()


class BakeWatch:
    """Sees that the bake of a sign was interrupted or killed.

    Clocks of machines differ: how long a bake is silent is measured by when its sign was seen to change.
    """

    def __init__(self, sign: Path) -> None:
        self._sign, self._seen, self._since = sign, 0, time.monotonic()
        # Who was seen alive: a container may have the machine's name, but other processes.
        self._alive = ""

    def is_gone(self) -> bool:
        """Return whether the bake has taken its sign away, is no process any more, or has been silent."""
        try:
            changed = self._sign.stat().st_mtime_ns
            who = self._sign.read_text()
            host, number = who.split()
            if host == socket.gethostname() and is_alive(int(number)):
                self._alive = who
            elif who == self._alive:
                return True
        except FileNotFoundError:
            if self._seen:
                return True
            changed = 0  # it is about to appear
        except (OSError, ValueError, OverflowError):
            changed = self._seen
        if changed != self._seen:
            self._seen, self._since = changed, time.monotonic()
        return time.monotonic() - self._since > SILENCE
