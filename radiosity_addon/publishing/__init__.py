"""Files put in their places so that a result is always whole, and folders that prove to be ours.

Every renaming of a file, and recovery after a kill.
"""

from __future__ import annotations

from .marked_folders import MarkedFolder, clean_up_folders
from .publish import Staging, clean_up, is_interrupted, replacing, write_text

__all__ = [
    "MarkedFolder",
    "Staging",
    "clean_up",
    "clean_up_folders",
    "is_interrupted",
    "replacing",
    "write_text",
]
