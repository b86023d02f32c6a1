"""What an export's report says besides its files: its forms, and which lightmaps it was made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .baked_files import LISTED

FORMS, LIGHTMAPS_OF = "export", "lightmaps"
"""Keys of an export's report: its forms, and the digests of its lightmaps by name."""


def images_described(contents: Mapping[str, Any]) -> set[str]:
    """Return the names of the images that a bake's report describes."""
    try:
        groups = [page["image"] for group in contents.get("light_groups", ()) for page in group["pages"]]
        return {*(entry["image"] for entry in contents["objects"]), *groups}
    except (KeyError, TypeError):
        return set()


def lightmap_digests(report: Mapping[str, Any]) -> dict[str, str]:
    """Return the digests that a bake's report lists of its lightmaps."""
    listed = report[LISTED]
    return {name: listed[name]["sha256"] for name in sorted(images_described(report)) if name in listed}


def forms_in(exported: Mapping[str, Any]) -> list[str]:
    """Return the forms that an export's report lists; none for a report of anything else."""
    listed = exported.get(FORMS)
    return [name for name in listed if isinstance(name, str)] if isinstance(listed, list) else []


def is_outdated(exported: Mapping[str, Any], lightmaps: Mapping[str, str]) -> bool:
    """Return whether an export's report is of other lightmaps than these."""
    return bool(forms_in(exported)) and exported.get(LIGHTMAPS_OF) != dict(lightmaps)
