"""Workers on a Dask cluster: its scheduler starts them, and starts those again that die.

Only this module imports `distributed`, which is no part of the extension. The cluster carries no data: that
is in the spool, which must be in a folder that all machines share.
"""

from __future__ import annotations

import importlib
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..base import BakeError
from .spool import Spool
from .worker import work

CONNECT = "10s"
"""How long a scheduler may take to answer."""

RETRIES = 3
"""Times that a worker is started again that failed."""

GRACE = 10.0
"""Seconds that workers have to see that the bake is over."""


class DaskWorkers:
    """As many workers as the cluster has threads; see `Helpers`.

    futures: One for each worker, as long as they work.
    Raises BakeError if `distributed` is not installed, or the scheduler does not answer.
    """

    def __init__(self, scheduler: str) -> None:
        self.problems: list[str] = []
        self.futures: list[Any] = []
        try:
            self._dask = importlib.import_module("distributed")
        except ImportError as error:
            raise BakeError(
                f"--farm {scheduler} needs Dask ({error.name} is not installed): run "
                "`pip install distributed`"
            ) from error
        try:
            self._client: Any = self._dask.Client(scheduler, timeout=CONNECT)
        except (OSError, ValueError, TypeError, RuntimeError) as error:
            raise BakeError(f"--farm {scheduler}: {_line(error)}; see Dask's settings for TLS") from error

    def start(self, spool: Spool) -> None:
        """See `Helpers`."""
        threads = sum(self._client.nthreads().values())
        paths = [str(spool.path)] * max(threads, 1)
        self.futures = self._client.map(help_bake, paths, pure=False, retries=RETRIES)

    def end(self) -> None:
        """See `Helpers`."""
        futures, self.futures = self.futures, []
        try:
            if futures:
                self._wait(futures)
                self._client.cancel(futures)
            self._client.close()
        except Exception as error:  # noqa: BLE001 - whatever becomes of the cluster, the bake is done
            self.problems.append(f"the cluster was lost: {_line(error)}")

    def _wait(self, futures: list[Any]) -> None:
        """Wait for the workers' end, and note which have failed."""
        with suppress(self._dask.TimeoutError):
            self._dask.wait(futures, GRACE)
        failed = Counter(_line(future.exception()) for future in futures if future.status == "error")
        self.problems += [
            f"{count} of {len(futures)} workers on the cluster failed: {why}" for why, count in failed.items()
        ]


def help_bake(spool: str) -> int:
    """Do tasks until the bake is over or gone; return how many. Runs on the cluster.

    Raises BakeError if the spool cannot be reached, or is of another version.
    """
    return work(Spool.to_work(Path(spool)), with_bake=True)


def _line(error: BaseException | None) -> str:
    return " ".join(str(error).split()) or type(error).__name__
