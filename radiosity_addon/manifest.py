"""Which files bakes have written into a folder, told by their reports: what may be cleaned away later.

`report.json` lists every file that bakes left in its folder, also those of earlier bakes, with size and
digest: a file that differs from what is listed is not what a bake wrote, and nobody's to delete.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

FILES = "files"
"""The report's key."""

LIGHTMAPS = frozenset({".exr", ".png"})
"""Endings of lightmap files, in lower case."""

_CHUNK = 1 << 20


def entry(path: Path, scene: str) -> dict[str, Any]:
    """Describe a file that a bake of the .blend `scene` wrote; "" is one that was never saved."""
    return {"bytes": path.stat().st_size, "sha256": digest(path), "scene": scene}


def digest(path: Path) -> str:
    """Return a file's SHA-256."""
    found = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK):
            found.update(chunk)
    return found.hexdigest()


def entries(new: Iterable[Path], report: Path, scene: str) -> dict[str, dict[str, Any]]:
    """Return what a new report is to list: the new files, and those the earlier report lists that are there.

    Parameters
    ----------
    new : iterable of Path
    report : Path
        The earlier report, if there is one.
    scene : str
        The .blend that was baked.
    """
    kept = {name: told for name, told in listed(report).items() if (report.parent / name).is_file()}
    return {**kept, **{path.name: entry(path, scene) for path in new}}


def listed(report: Path) -> dict[str, dict[str, Any]]:
    """Return what a report lists of the files beside it; nothing if it is no report of ours."""
    try:
        told = json.loads(report.read_text(encoding="utf-8"))
        files = told[FILES]
        return {
            str(name): {"bytes": int(of["bytes"]), "sha256": str(of["sha256"]), "scene": str(of["scene"])}
            for name, of in files.items()
            if Path(name).name == name
        }
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def is_as_written(path: Path, told: dict[str, Any]) -> bool:
    """Tell whether a file is, to the byte, what a bake wrote."""
    try:
        return bool(path.stat().st_size == told["bytes"] and digest(path) == told["sha256"])
    except OSError:
        return False


def forget(report: Path, names: Iterable[str]) -> None:
    """Take files off a report's list, over the old report only once the new one is whole."""
    told = json.loads(report.read_text(encoding="utf-8"))
    for name in names:
        told.get(FILES, {}).pop(name, None)
    aside = report.with_name(f".{report.name}.part")
    aside.write_text(json.dumps(told, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    aside.replace(report)
