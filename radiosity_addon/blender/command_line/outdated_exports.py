"""Say so where an export is older than the lightmaps next to it; needs no Blender."""

from __future__ import annotations

from pathlib import Path

from ...cli import Console
from ...files import (
    EXPORT_FOLDER,
    REPORT_NAME,
    NoReportError,
    forms_in,
    is_outdated,
    lightmap_digests,
    read_report,
)


def warn_of_outdated(folder: Path, console: Console) -> None:
    """Say so if the export next to a bake is of earlier lightmaps."""
    try:
        exported = read_report(folder / EXPORT_FOLDER / REPORT_NAME)
        digests = lightmap_digests(read_report(folder / REPORT_NAME))
    except (OSError, NoReportError):
        return
    if is_outdated(exported, folder / EXPORT_FOLDER, digests):
        command = f"export {folder} --forms {','.join(forms_in(exported))}"
        place = folder / EXPORT_FOLDER
        console.lines([f"warning: the export in {place} is older than the lightmaps: run {command}"])
