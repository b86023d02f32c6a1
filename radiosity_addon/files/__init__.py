"""Files of a bake: their names, and proof that they are ours.

Needs nothing but Python.
"""

from __future__ import annotations

from .baked_files import (
    LISTED,
    OWNER,
    NoReportError,
    Owner,
    digest_of_file,
    entries,
    is_as_written,
    is_as_written_steps,
    read_report,
    reports_in,
    sealed,
    text_of,
    without,
)
from .export_reports import (
    Mix,
    export_record,
    forms_in,
    images_described,
    is_outdated,
    lightmap_digests,
    older_files,
)
from .file_names import (
    BLEND_NAME,
    EXPORT_FOLDER,
    LIGHTMAPS,
    PLAIN_NAMES,
    PREVIEW_NAME,
    REPORT_NAME,
    SIDECAR_NAME,
    FileNames,
    folded,
    highest_page,
    is_bake_name,
    unique_names,
)
from .sidecar_names import BAKE, DIGEST, FILE, KEPT

__all__ = [
    "BAKE",
    "BLEND_NAME",
    "DIGEST",
    "EXPORT_FOLDER",
    "FILE",
    "KEPT",
    "LIGHTMAPS",
    "LISTED",
    "OWNER",
    "PLAIN_NAMES",
    "PREVIEW_NAME",
    "REPORT_NAME",
    "SIDECAR_NAME",
    "FileNames",
    "Mix",
    "NoReportError",
    "Owner",
    "digest_of_file",
    "entries",
    "export_record",
    "folded",
    "forms_in",
    "highest_page",
    "images_described",
    "is_as_written",
    "is_as_written_steps",
    "is_bake_name",
    "is_outdated",
    "lightmap_digests",
    "older_files",
    "read_report",
    "reports_in",
    "sealed",
    "text_of",
    "unique_names",
    "without",
]
