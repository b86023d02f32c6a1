"""Charts: cutting a mesh into flat pieces.

xatlas does the cutting; only `xatlas_worker.py` imports it.
"""

from __future__ import annotations

from .cut_charts import Charts, join_charts, split_charts, unwrap
from .flatten import rescale_to_area
from .growers import PatientGrower

__all__ = [
    "Charts",
    "PatientGrower",
    "join_charts",
    "rescale_to_area",
    "split_charts",
    "unwrap",
]
