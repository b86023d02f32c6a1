"""What everything else may use: errors, warnings, progress of long work, time left.

Needs nothing but Python.
"""

from __future__ import annotations

from .background import elsewhere, in_thread
from .bake_warning import BakeWarning
from .errors import BakeError, NothingToDoError, RadiosityError, SceneError, UsageError
from .progress import SILENT, Cancelled, Expected, Progress, Status
from .similar_warnings import one_of_each
from .steps import drain, staged
from .ticks import linear_ticks, tick_label
from .time_left import RemainingTime, duration

__all__ = [
    "SILENT",
    "BakeError",
    "BakeWarning",
    "Cancelled",
    "Expected",
    "NothingToDoError",
    "Progress",
    "RadiosityError",
    "RemainingTime",
    "SceneError",
    "Status",
    "UsageError",
    "drain",
    "duration",
    "elsewhere",
    "in_thread",
    "linear_ticks",
    "one_of_each",
    "staged",
    "tick_label",
]
