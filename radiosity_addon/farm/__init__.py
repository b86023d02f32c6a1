"""Bakes shared by several processes, on one machine or many, through a folder that all of them see.

The bake itself is the one of `bake/`: it runs in one process, which gives the heavy kernels away.
"""

from __future__ import annotations

from .executor import shared_bake
from .spool import Spool

__all__ = ["Spool", "shared_bake"]
