"""What everything else may use: errors, warnings, progress of long work, time left.

Needs nothing but Python.
"""

from __future__ import annotations

from .bake_warning import BakeWarning
from .errors import BakeError, NothingToDoError, RadiosityError, SceneError, UsageError
from .progress import drain, scaled
from .similar_warnings import one_of_each
from .ticks import linear_ticks, tick_label
from .time_left import RemainingTime, duration

__all__ = [
    "BakeError",
    "BakeWarning",
    "NothingToDoError",
    "RadiosityError",
    "RemainingTime",
    "SceneError",
    "UsageError",
    "drain",
    "duration",
    "linear_ticks",
    "one_of_each",
    "scaled",
    "tick_label",
]
