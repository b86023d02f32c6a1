"""The panel's bake with the help of a command of the user's."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import bpy

from ...bake import Baking
from ...base import BakeError
from ...farm import FarmCommand, shared_in_folder, shared_pipeline
from ..settings.preferences import preferences
from .finish import BakeJob


def farm_of(context: bpy.types.Context) -> tuple[FarmCommand | None, Baking | None]:
    """Return the command that the preferences give, and the bake shared with it; nothing if they do not.

    Raises BakeError if there is no such folder for spools.
    """
    chosen = preferences(context)
    command, folder = chosen.farm_command.strip(), chosen.spool_folder.strip()
    if not command or not folder:
        return None, None
    place = Path(bpy.path.abspath(folder)).expanduser()
    if not place.is_absolute() or (folder.startswith("//") and not bpy.data.filepath):
        raise BakeError(f"Spool Folder '{folder}' in the preferences: give the whole path")
    if not place.is_dir():
        raise BakeError(f"Spool Folder '{folder}' in the preferences is no folder: make it, or mount it")
    started = FarmCommand(command)
    return started, shared_pipeline(partial(shared_in_folder, place, started))


def ended_with(job: BakeJob, command: FarmCommand) -> BakeJob:
    """Run a bake, and end its command with it: when it is canceled, its own thread may still go on."""
    try:
        return (yield from job)
    finally:
        command.end()
