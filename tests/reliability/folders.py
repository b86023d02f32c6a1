"""Folders before and after a bake: whole trees by digest, results by their reports, and what is left over."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any


def tree(folder: Path, *without: Path) -> dict[str, str]:
    """Return what every file, link and folder below `folder` holds, by relative path."""
    found: dict[str, str] = {}
    for root, folders, files in os.walk(folder):
        here = Path(root)
        folders[:] = [name for name in folders if here / name not in without]
        for name in (*folders, *files):
            path = here / name
            if path not in without:
                found[str(path.relative_to(folder))] = _content(path)
    return found


def _content(path: Path) -> str:
    if path.is_symlink():
        return f"link to {path.readlink()}"
    if path.is_dir():
        return "folder"
    if not path.is_file():
        return "special"
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        return f"unreadable: {error.strerror}"


def changes(before: dict[str, str], after: dict[str, str], new_allowed: bool = False) -> list[str]:
    """Tell where two trees differ; files that are new may be left out."""
    lines = [f"gone: {name}" for name in before.keys() - after.keys()]
    lines += [f"changed: {name}" for name in before.keys() & after.keys() if before[name] != after[name]]
    if not new_allowed:
        lines += [f"new: {name}" for name in after.keys() - before.keys()]
    return sorted(lines)


def reports(folder: Path) -> dict[Path, dict[str, Any]]:
    """Return the reports of bakes in a folder, whatever they are called."""
    found = {}
    for path in sorted(folder.glob("*.json")) if folder.is_dir() else ():
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        if isinstance(told, dict) and isinstance(told.get("objects"), list) and "solver" in told:
            found[path] = told
    return found


def images_of(report: dict[str, Any]) -> list[str]:
    """Return the names of all images a report tells of."""
    names = [entry["image"] for entry in report["objects"]]
    names += [page["image"] for group in report.get("light_groups", ()) for page in group["pages"]]
    return list(dict.fromkeys(names))


def listed(folder: Path) -> dict[str, dict[str, Any]]:
    """Return every file that a report in the folder lists, by name."""
    found = {}
    for report in reports(folder).values():
        files = report.get("files")
        for name, told in files.items() if isinstance(files, dict) else ():
            # A trial may have put anything else in place of an entry.
            if isinstance(told, dict) and isinstance(told.get("sha256"), str):
                found[name] = dict(told)
    return found


def broken_result(folder: Path) -> list[str]:
    """Tell what is wrong with the result in a folder: no report, or files that differ from what it lists."""
    told = reports(folder)
    if not told:
        return ["no report"]
    lines = []
    for name, entry in listed(folder).items():
        path = folder / name
        if not path.is_file():
            lines.append(f"missing: {name}")
        elif hashlib.sha256(path.read_bytes()).hexdigest() != entry["sha256"]:
            lines.append(f"not as listed: {name}")
    for report in told.values():
        lines += [f"missing image: {name}" for name in images_of(report) if not (folder / name).is_file()]
    return lines


def leftovers(*folders: Path) -> list[str]:
    """Return staging files and folders, and Blender's temporary folders, that bakes have left behind."""
    found = []
    for folder in folders:
        for path in folder.rglob("*") if folder.is_dir() else ():
            name = path.name
            ours = name.startswith((".radiosity", ".baked", "blender_")) or name.endswith(
                (".part", ".blend@")
            )
            if ours or (name.startswith(".") and "lightmap" in name):
                found.append(str(path))
    return sorted(found)
