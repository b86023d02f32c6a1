"""The workers that a command line asks for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ..cli import FarmSpec
from .dask_workers import DaskWorkers
from .helpers import Helpers
from .local_workers import LocalWorkers


@contextmanager
def wanted_helpers(farm: FarmSpec | None) -> Iterator[Helpers | None]:
    """Yield what starts the workers that were asked for, and end them.

    Raises BakeError if the cluster is out of reach.
    """
    if farm is None:
        yield None
        return
    helpers: Helpers = DaskWorkers(farm.scheduler) if farm.scheduler else LocalWorkers(farm.workers)
    try:
        yield helpers
    finally:
        helpers.end()
