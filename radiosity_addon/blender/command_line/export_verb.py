"""The verb `export DIR`, and `bake --export`: a bake's folder, exported into a folder in it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ...base import SceneError, UsageError
from ...cli import Console, Interrupts, Permissions, run_through
from ...files import (
    BLEND_NAME,
    EXPORT_FOLDER,
    LISTED,
    OWNER,
    REPORT_NAME,
    NoReportError,
    images_described,
    is_as_written,
    lightmap_digests,
    read_report,
)
from ...options import Form
from ..exporting.export import run_export
from ..files.files import open_scene
from ..jobs.finish import WRITING_STAGES
from .export_places import output_of_export
from .verbs import registered


def export(folder: Path, form: Form, allowed: Permissions, console: Console, interrupts: Interrupts) -> None:
    """Export the bake in a folder into its folder `export`.

    Raises
    ------
    RadiosityError
        If there is no bake in it, or a file of the bake is gone or changed.
    """
    folder = folder.expanduser().resolve()
    report = _report_of(folder)
    edited = not is_as_written(folder / BLEND_NAME, report[LISTED][BLEND_NAME])
    with registered():
        console.progress("open", 0.0)
        open_scene(folder / BLEND_NAME, allowed.scripts)
        scene = bpy.data.scenes.get(report[OWNER]["scene"])
        if scene is None:
            raise SceneError(f"'{folder / BLEND_NAME}' has no scene '{report[OWNER]['scene']}': bake again")
        if bpy.context.window is not None:
            bpy.context.window.scene = scene
        output = output_of_export(folder, scene.name, allowed)
        digests = lightmap_digests(report)
        job = run_export(bpy.context, form, output, digests, compare=edited)
        made = run_through(job, console, interrupts, WRITING_STAGES)
        lines = [f"exported into {folder / EXPORT_FOLDER}", *(f"  {name}" for name in made.files)]
        notes = [f"{BLEND_NAME} was changed since it was baked: it is exported as it is"] if edited else []
        console.lines([*lines, *(f"note: {note}" for note in (*notes, *made.notes))])


def _report_of(folder: Path) -> dict[str, Any]:
    """Return the report of the bake in a folder whose lightmaps are as the bake wrote them.

    The .blend may have been changed: sliders of light groups are in it.
    """
    if not folder.is_dir():
        raise UsageError(f"{folder} is no folder: give the one that was baked into")
    path = folder / REPORT_NAME
    try:
        report = read_report(path)
    except FileNotFoundError:
        raise UsageError(f"{folder} holds no bake ({REPORT_NAME} is missing): bake into it first") from None
    except (NoReportError, OSError) as error:
        raise UsageError(f"'{path}' {error}: bake again") from None
    if BLEND_NAME not in report[LISTED]:
        raise UsageError(f"{folder} holds no {BLEND_NAME}: bake with the command line, or export in Blender")
    for name in (BLEND_NAME, *sorted(images_described(report))):
        file = folder / name
        if not file.is_file():
            raise SceneError(f"'{file}' is missing: put it back, or bake again")
        if name in report[LISTED] and name != BLEND_NAME and not is_as_written(file, report[LISTED][name]):
            raise SceneError(f"'{file}' was changed since it was baked: bake again")
    return report
