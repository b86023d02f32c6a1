"""The command line's parser and output.

Needs neither Blender nor NumPy.
"""

from __future__ import annotations

from .console import Console, summary
from .farm_spec import FarmSpec
from .interrupts import Interrupts
from .parser import (
    bake_output,
    build_parser,
    check_keeping,
    check_plot,
    check_sharing,
    requested_settings,
)
from .path_checks import check_folder, printable
from .permissions import Permissions
from .temporary_folder import TemporaryFolder

__all__ = [
    "Console",
    "FarmSpec",
    "Interrupts",
    "Permissions",
    "TemporaryFolder",
    "bake_output",
    "build_parser",
    "check_folder",
    "check_keeping",
    "check_plot",
    "check_sharing",
    "printable",
    "requested_settings",
    "summary",
]
