"""Bakes shared by several processes, on one machine or many, through a folder that all of them see.

The bake itself is the one of `bake/`: it runs in one process, which gives the heavy kernels away.
"""

from __future__ import annotations

from .commands import main as run_command
from .dask_workers import DaskWorkers
from .executor import shared_bake
from .farm_command import FarmCommand
from .helpers import Helpers
from .local_workers import LocalWorkers
from .output_spool import given_spool, own_spool, shared_in_folder
from .records import ShareRecord
from .spool import Spool

__all__ = [
    "DaskWorkers",
    "FarmCommand",
    "Helpers",
    "LocalWorkers",
    "ShareRecord",
    "Spool",
    "given_spool",
    "own_spool",
    "run_command",
    "shared_bake",
    "shared_in_folder",
]
