"""Bakes shared by several processes, on one machine or many, through a folder that all of them see.

The bake itself is the one of `bake/`: it runs in one process, which gives the heavy kernels away.
"""

from __future__ import annotations

from .commands import main as run_command
from .dask_workers import DaskWorkers
from .executor import shared_bake
from .farm_command import FarmCommand
from .helper_choice import wanted_helpers
from .helpers import Helpers
from .local_workers import LocalWorkers
from .output_spool import given_spool, own_spool, shared_in_folder, spool_to_prepare
from .pipeline_sharing import shared_pipeline
from .prepared import BakeInputs, PreparedBake, prepared_in
from .records import ShareRecord
from .spool import Spool
from .stages import finished_into, finishing, result_in, say_finished, store_prepared

__all__ = [
    "BakeInputs",
    "DaskWorkers",
    "FarmCommand",
    "Helpers",
    "LocalWorkers",
    "PreparedBake",
    "ShareRecord",
    "Spool",
    "finished_into",
    "finishing",
    "given_spool",
    "own_spool",
    "prepared_in",
    "result_in",
    "run_command",
    "say_finished",
    "shared_bake",
    "shared_in_folder",
    "shared_pipeline",
    "spool_to_prepare",
    "store_prepared",
    "wanted_helpers",
]
