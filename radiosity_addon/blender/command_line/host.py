"""`blender -b FILE --command radiosity …`: the command line inside a running Blender."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from .main import main

COMMAND = "radiosity"

_handles: list[Any] = []


def register() -> None:
    """Offer the command to Blender."""
    _handles.append(bpy.utils.register_cli_command(COMMAND, run))


def unregister() -> None:
    """Take the command back."""
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())


def run(argv: list[str]) -> int:
    """Run one command on the file that Blender has open; return its exit code."""
    loaded = Path(bpy.data.filepath) if bpy.data.filepath else None
    return main(argv, prog=f"blender -b FILE --command {COMMAND}", loaded=loaded)
