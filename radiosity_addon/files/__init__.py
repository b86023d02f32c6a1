"""Files of a bake: their names, proof that they are ours, publishing a result as a whole.

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
from .file_names import (
    BLEND_NAME,
    LIGHTMAPS,
    PLAIN_NAMES,
    PREVIEW_NAME,
    REPORT_NAME,
    SIDECAR_NAME,
    FileNames,
    folded,
    highest_page,
    unique_names,
)
from .file_versions import MOST_FILES, HeldFiles
from .gltf_check import gltf_fault
from .path_checks import check_folder, checked_folder, checked_name, checked_path, escaped, printable
from .publish import Staging, clean_up, is_interrupted, replacing
from .sidecar_names import BAKE, DIGEST, FILE, KEPT
from .temporary_folder import TemporaryFolder

__all__ = [
    "BAKE",
    "BLEND_NAME",
    "DIGEST",
    "FILE",
    "KEPT",
    "LIGHTMAPS",
    "LISTED",
    "MOST_FILES",
    "OWNER",
    "PLAIN_NAMES",
    "PREVIEW_NAME",
    "REPORT_NAME",
    "SIDECAR_NAME",
    "FileNames",
    "HeldFiles",
    "NoReportError",
    "Owner",
    "Staging",
    "TemporaryFolder",
    "check_folder",
    "checked_folder",
    "checked_name",
    "checked_path",
    "clean_up",
    "digest_of_file",
    "entries",
    "escaped",
    "folded",
    "gltf_fault",
    "highest_page",
    "is_as_written",
    "is_as_written_steps",
    "is_interrupted",
    "printable",
    "read_report",
    "replacing",
    "reports_in",
    "sealed",
    "text_of",
    "unique_names",
    "without",
]
