"""The command line's parser, and what it prints.

Needs neither Blender nor NumPy.
"""

from __future__ import annotations

from .console import Console, summary
from .interrupts import Interrupts
from .parser import bake_output, build_parser, check_keeping, check_plot, requested_settings

__all__ = [
    "Console",
    "Interrupts",
    "bake_output",
    "build_parser",
    "check_keeping",
    "check_plot",
    "requested_settings",
    "summary",
]
