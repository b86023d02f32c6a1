"""`blender -b FILE --command radiosity …`: the command line inside a running Blender."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ..registration import also_undo

COMMAND = "radiosity"

OF_SPOOLS = ("run", "worker", "status", "task")
"""Commands that need a spool and no file."""

_handles: list[Any] = []


def register() -> None:
    """Offer the command to Blender, once, until the extension is unregistered."""
    if not _handles:
        _handles.append(bpy.utils.register_cli_command(COMMAND, run))
        also_undo(unregister)


def unregister() -> None:
    """Take the command back."""
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())


def run(argv: list[str]) -> int:
    """Run one command on the file that Blender has open, or on a spool; return its exit code."""
    if argv and argv[0] in OF_SPOOLS:
        from ...farm import run_command

        return run_command(argv, f"blender -b --command {COMMAND}")
    from .main import main

    loaded = Path(bpy.data.filepath) if bpy.data.filepath else None
    return main(argv, prog=f"blender -b FILE --command {COMMAND}", loaded=loaded)
