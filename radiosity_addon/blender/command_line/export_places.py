"""Where the command line exports to, and whether an export may be written there."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...base import BakeError
from ...cli import Permissions
from ...files import BLEND_NAME, EXPORT_FOLDER, Owner
from ...options import Form
from ..exporting.export import foreseen_files
from ..exporting.shown_lightmaps import refuse_quantity
from ..files.output import OutputFolder


def output_of_export(folder: Path, scene: str, allowed: Permissions) -> OutputFolder:
    """Return the folder of the export of a scene that was baked into a folder."""
    owner = Owner(str(folder / BLEND_NAME), scene)
    return OutputFolder(folder / EXPORT_FOLDER, overwrite=allowed.overwrite, owner=owner)


def check_export(folder: Path, form: Form, quantity: str, allowed: Permissions) -> None:
    """See, before the open scene is baked into a folder, that it can be exported next to the bake.

    Raises
    ------
    RadiosityError
        If engines cannot use the quantity, or a file that is not ours is in an export's place.
    """
    refuse_quantity(quantity)
    output = output_of_export(folder.expanduser().resolve(), bpy.context.scene.name, allowed)
    refusal = output.refusal(foreseen_files(form))
    if refusal is not None:
        raise BakeError(refusal)
