"""What an export's report says besides its files: its forms, and which lightmaps it was made of."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from .baked_files import LISTED
from .file_names import is_bake_name

FORMS, LIGHTMAPS_OF, MIX, OLDER = "export", "lightmaps", "light_groups", "older_files"
"""Keys of an export's report: all forms that are in its folder, the digests of its lightmaps by name, the
factors of its light groups, and files that are still there of an earlier export of other lightmaps."""

Mix = Mapping[str, tuple[float, float, float]]
"""Color times strength of each light group."""


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
    return _texts(exported.get(FORMS))


def export_record(
    earlier: Mapping[str, Any] | None,
    forms: Iterable[str],
    lightmaps: Mapping[str, str],
    mix: Mix,
    left: Collection[str],
) -> dict[str, Any]:
    """Return what the report of an export says besides its files.

    earlier: The report that it replaces, if there is one.
    left: Files that depend on lightmaps, that other forms have, and that this export does not write.
    """
    before = {} if earlier is None else earlier
    remain = sorted(name for name in left if name in before.get(LISTED, ()))
    record: dict[str, Any] = {LIGHTMAPS_OF: dict(lightmaps), MIX: {name: list(mix[name]) for name in mix}}
    if all(before.get(key) == value for key, value in record.items()):
        remain = [name for name in remain if name in _texts(before.get(OLDER))]
    record[FORMS] = list(dict.fromkeys((*forms_in(before), *forms)))
    return record | ({OLDER: remain} if remain else {})


def older_files(exported: Mapping[str, Any], folder: Path) -> list[str]:
    """Return the files in an export's folder that are of lightmaps before its own."""
    return [name for name in _texts(exported.get(OLDER)) if is_bake_name(name) and (folder / name).is_file()]


def is_outdated(
    exported: Mapping[str, Any], folder: Path, lightmaps: Mapping[str, str], mix: Mix | None = None
) -> bool:
    """Return whether an export is, wholly or in part, of other lightmaps than these, or mixes them otherwise.

    exported: The report in its folder.
    mix: None where it is not known.
    """
    if not forms_in(exported):
        return False
    mixed = None if mix is None else {name: list(mix[name]) for name in mix}
    return (
        exported.get(LIGHTMAPS_OF) != dict(lightmaps)
        or (mixed is not None and exported.get(MIX, {}) != mixed)
        or bool(older_files(exported, folder))
    )


def _texts(value: Any) -> list[str]:
    return [each for each in value if isinstance(each, str)] if isinstance(value, list) else []
