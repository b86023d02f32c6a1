"""A command of the user's that starts workers."""

from __future__ import annotations

import shlex
import sys
from threading import Lock

from .processes import HelpingProcess
from .spool import Spool

SPOOL = "{spool}"
"""What the bake's folder takes the place of."""


class FarmCommand:
    """Runs a command once, without a shell, and ends it with the bake; see `Helpers`.

    command: Its words, as a shell would have them; `{spool}` in them stands for the spool's folder.
    process: As long as it has been started and not been ended.
    """

    def __init__(self, command: str) -> None:
        self.problems: list[str] = []
        self._command = command
        self.process: HelpingProcess | None = None
        self._ended, self._lock = False, Lock()

    def start(self, spool: Spool) -> None:
        """See `Helpers`."""
        try:
            words = [word.replace(SPOOL, str(spool.path)) for word in split(self._command)]
            with self._lock:
                if words and not self._ended:
                    self.process = HelpingProcess(words)
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or str(error)
            self.problems.append(f"the farm command cannot be started: {why}; the bake went on alone")

    def end(self) -> None:
        """See `Helpers`; may be called at any time, by another thread, and again."""
        with self._lock:
            self._ended = True
            process, self.process = self.process, None
            if process is None:
                return
            if process.code:
                self.problems.append(f"the farm command failed: {process.last_words()}")
            process.end()


def split(command: str, windows: bool = sys.platform == "win32") -> list[str]:
    """Return the words of a command. Raises ValueError if a quotation is not closed.

    windows: Backslashes are parts of paths, and only double quotes quote.
    """
    lexer = shlex.shlex(command, posix=True, punctuation_chars=False)
    lexer.whitespace_split, lexer.commenters = True, ""
    if windows:
        lexer.escape, lexer.quotes = "", '"'
    return list(lexer)
