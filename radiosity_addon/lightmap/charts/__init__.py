"""Charts: cutting a mesh into flat pieces.

xatlas does the cutting; only `xatlas_worker.py` imports it.
"""

from __future__ import annotations

from .cut_charts import PIECE, Charts, unwrap
from .flatten import rescale_to_area
from .growers import PatientGrower

__all__ = [
    "PIECE",
    "Charts",
    "PatientGrower",
    "rescale_to_area",
    "unwrap",
]
