"""A process that helps a bake: watched, and ended with it."""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import IO

GRACE = 5.0
"""Seconds that a process has to end before it is killed."""

MOST_SAID = 300
"""Characters that are repeated of what a process said."""


class HelpingProcess:
    """A process in a session of its own: Ctrl-C ends the bake, which ends it. Its errors are kept.

    Raises OSError if it cannot be started.
    """

    def __init__(self, words: Sequence[str], environment: Mapping[str, str] | None = None) -> None:
        self._said: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - closed at the end
        flags = ("CREATE_NO_WINDOW", "CREATE_NEW_PROCESS_GROUP")  # Windows'
        try:
            self._process = subprocess.Popen(
                list(words),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=self._said,
                env=environment,
                start_new_session=True,
                creationflags=sum(getattr(subprocess, flag, 0) for flag in flags),
            )
        except BaseException:
            self._said.close()
            raise

    @property
    def code(self) -> int | None:
        """Its exit code; None as long as it runs."""
        return self._process.poll()

    def last_words(self) -> str:
        """Return the last line of its errors, or else how it ended."""
        with suppress(OSError, ValueError):
            self._said.seek(0)
            lines = self._said.read().decode(errors="replace").split("\n")
            said = [line.strip() for line in lines if line.strip()]
            if said:
                return said[-1][:MOST_SAID]
        code = self._process.returncode
        return f"killed by signal {-code}" if code is not None and code < 0 else f"exit code {code}"

    def end(self) -> None:
        """End it, and what it has started, as long as it runs."""
        if self._said.closed:
            return
        if self.code is None:
            self._signal("SIGTERM")
            try:
                self._process.wait(GRACE)
            except subprocess.TimeoutExpired:
                self._signal("SIGKILL")
                self._process.wait()
        self._said.close()

    def _signal(self, name: str) -> None:
        with suppress(OSError):
            if hasattr(os, "killpg"):
                os.killpg(self._process.pid, getattr(signal, name))
            else:
                self._process.kill()
