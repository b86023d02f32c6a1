"""Workers on the machine that bakes."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from threading import Event, Thread

from .processes import HelpingProcess
from .spool import Spool

PACKAGE = Path(__file__).resolve().parent.parent

LOOK = 0.2
"""Seconds between looks for workers that have died."""

RETRIES = 3
"""Times that a worker is started again."""


class LocalWorkers:
    """Some workers of one thread each, which end with the bake, also if it is killed; see `Helpers`.

    One that dies is started again, a few times.
    """

    def __init__(self, count: int) -> None:
        self.problems: list[str] = []
        self._count, self._running = count, dict[int, HelpingProcess]()
        self._starts = dict.fromkeys(range(1, count + 1), 0)
        self._over, self._watch = Event(), Thread()

    def start(self, spool: Spool) -> None:
        """See `Helpers`."""
        self._watch = Thread(target=self._keep, args=(spool,), daemon=True)
        self._watch.start()

    def end(self) -> None:
        """See `Helpers`."""
        self._over.set()
        if self._watch.is_alive():
            self._watch.join()
        for process in self._running.values():
            process.end()

    def _keep(self, spool: Spool) -> None:
        """Start all workers, and again those that have died."""
        while True:
            for number in self._starts:
                process = self._running.get(number)
                if self._over.is_set():
                    return
                if process is None and self._starts[number] == 0:
                    self._start(number, spool)
                elif process is not None and process.code is not None and not spool.is_over():
                    self._follow(number, process, spool)
            self._over.wait(LOOK)

    def _follow(self, number: int, process: HelpingProcess, spool: Spool) -> None:
        """Start a worker again that has ended, or give it up."""
        said = process.last_words()
        process.end()
        del self._running[number]
        if self._starts[number] <= RETRIES:
            self._start(number, spool)
        else:
            self._give_up(number, said)

    def _start(self, number: int, spool: Spool) -> None:
        self._starts[number] += 1
        try:
            self._running[number] = start_worker(spool)
        except OSError as error:
            self._give_up(number, f"cannot be started: {error.strerror}")

    def _give_up(self, number: int, why: str) -> None:
        times = self._starts[number]
        self.problems.append(
            f"worker {number} of {self._count} ended {times} times and was given up; last: {why}"
        )


def start_worker(spool: Spool) -> HelpingProcess:
    """Start a worker of this installation and this Python. Raises OSError if it cannot be started."""
    # An installed extension's package has another name inside Blender, and packages in other folders.
    paths = [str(PACKAGE.parent), *filter(None, sys.path)]
    return HelpingProcess(
        [sys.executable, "-m", f"{PACKAGE.name}.farm", "worker", str(spool.path), "--with-bake"],
        {**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
    )
