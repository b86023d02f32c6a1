"""The command line's parser and output.

Needs neither Blender nor NumPy.
"""

from __future__ import annotations

from .console import Console, summary
from .endings import OUT_OF_MEMORY, fail, with_notes
from .farm_spec import FarmSpec, read_farm_spec
from .interrupts import Interrupts
from .parser import (
    bake_output,
    build_parser,
    check_blend,
    check_keeping,
    check_plot,
    check_scene,
    check_sharing,
    given_options,
    requested_settings,
)
from .path_checks import check_folder, escaped, printable, quoted
from .permissions import Permissions
from .running import run_through
from .temporary_folder import TemporaryFolder

__all__ = [
    "OUT_OF_MEMORY",
    "Console",
    "FarmSpec",
    "Interrupts",
    "Permissions",
    "TemporaryFolder",
    "bake_output",
    "build_parser",
    "check_blend",
    "check_folder",
    "check_keeping",
    "check_plot",
    "check_scene",
    "check_sharing",
    "escaped",
    "fail",
    "given_options",
    "printable",
    "quoted",
    "read_farm_spec",
    "requested_settings",
    "run_through",
    "summary",
    "with_notes",
]
