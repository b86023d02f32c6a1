"""What a bake says of itself: report.json, and the panel's figures."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ...base import BakeError, BakeWarning
from ...files import LISTED, OWNER, sealed, text_of
from ...publishing import write_text
from ...scene import LIGHTMAP_UV_LAYER, BakeObject
from .result import BakeResult

T = TypeVar("T")

REPORT_VERSION = 2
MAX_HISTORY = 200
"""Entries of the solver's history that a report keeps; shooting makes one a shot."""


@dataclass(frozen=True)
class LightmapFile:
    """An atlas page's file.

    Parameters
    ----------
    path : str
        Relative to the output folder, with forward slashes.
    scale : float or None
        What a texel must be multiplied by to get the quantity; None where the file holds
        the quantity itself.
    """

    path: str
    scale: float | None = None


@dataclass(frozen=True)
class BakeReport:
    """A bake's report, ready for JSON."""

    data: dict[str, Any]

    @classmethod
    def of(
        cls,
        result: BakeResult,
        files: Sequence[LightmapFile],
        seconds: dict[str, float],
        groups: Sequence[Sequence[LightmapFile]] = (),
    ) -> BakeReport:
        """Report a bake.

        Parameters
        ----------
        result : BakeResult
        files : sequence of LightmapFile
            Parallel to `result.pages`.
        seconds : dict of str to float
            Wall-clock time of every stage, those outside the pipeline included.
        groups : sequence of sequence of LightmapFile
            Parallel to `result.groups`, and each to `result.pages`.
        """
        facts = result.atlas or ({},) * len(files)
        pages = [{"image": file.path, **_plain(page)} for file, page in zip(files, facts, strict=True)]
        objects = []
        light = result.light or ({},) * len(result.objects)
        for baked, of_light in zip(result.objects, light, strict=True):
            height, width = result.pages[baked.page].pixels.shape[:2]
            file = files[baked.page]
            entry: dict[str, Any] = {
                "object": baked.object.name,
                "uv_layer": LIGHTMAP_UV_LAYER,
                "image": file.path,
                "resolution": [width, height],
                "atlas": baked.page,
            }
            if file.scale is not None:
                entry["scale"] = file.scale
            if baked.density is not None:
                entry["texels_per_metre"] = baked.density
            if baked.share is not None:
                entry["share_of_page"] = baked.share
            if baked.object.name in result.coincident:
                entry["coincident_triangles"] = result.coincident[baked.object.name]
            objects.append({**entry, **_plain(of_light)})
        solver = {key: value for key, value in result.solver.items() if key != "history"}
        solver["history"] = thinned(result.solver.get("history", ()))
        shares = [
            {"group": group.name, "sources": list(group.sources), "pages": [_file(file) for file in of]}
            for group, of in zip(result.groups, groups, strict=True)
        ]
        notes = [_said(warning) for warning in result.warnings if warning.is_note]
        return cls(
            {
                "version": REPORT_VERSION,
                "objects": objects,
                "pages": pages,
                **({"light_groups": shares} if shares else {}),
                "solver": _plain(solver),
                "warnings": [_said(warning) for warning in result.warnings if not warning.is_note],
                **({"notes": notes} if notes else {}),
                "seconds": {stage: round(float(taken), 4) for stage, taken in seconds.items()},
                **({"performance": _plain(result.performance)} if result.performance else {}),
            }
        )

    def as_dict(self) -> dict[str, Any]:
        """The report as report.json holds it."""
        return self.data

    def joined(self, earlier: Mapping[str, Any] | None, objects: Collection[str]) -> BakeReport:
        """Return the report with what the one before says of objects that have kept their lightmaps."""
        try:
            before = {} if earlier is None or not objects else earlier
            entries = [dict(entry) for entry in before.get("objects", ()) if entry["object"] in objects]
            numbers = sorted({entry["atlas"] for entry in entries})
            pages = [before["pages"][number] for number in numbers]
        except (OSError, ValueError, KeyError, TypeError, IndexError, AttributeError):
            return self
        count = len(self.data["pages"])
        for entry in entries:
            entry["atlas"] = count + numbers.index(entry["atlas"])
        joined = {"objects": [*self.data["objects"], *entries], "pages": [*self.data["pages"], *pages]}
        return BakeReport({**self.data, **joined})

    def proven(self, files: Mapping[str, Mapping[str, Any]], owner: Mapping[str, str]) -> BakeReport:
        """Return the report with what proves which files are ours, see `baked_files.py`.

        Parameters
        ----------
        files : mapping of str to mapping
            All that bakes have written next to it.
        owner : mapping of str to str
            The file and scene that were baked.
        """
        listed = {name: dict(entry) for name, entry in files.items()}
        return BakeReport(sealed({**self.data, OWNER: dict(owner), LISTED: listed}))

    def write(self, path: Path) -> None:
        """Write the report as JSON.

        Raises
        ------
        BakeError
            If it cannot be written.
        """
        try:
            path.write_text(text_of(self.data), encoding="utf-8")
        except OSError as error:
            raise BakeError(f"cannot write the report '{path}': {error.strerror}") from error

    def write_copy(self, path: Path) -> None:
        """Write the report as JSON over an older copy, once it is whole.

        Raises
        ------
        BakeError
            If it cannot be written.
        """
        write_text(path, text_of(self.data))


def solver_part(
    found: Mapping[str, Any], settings: Mapping[str, Any], objects: Sequence[BakeObject]
) -> dict[str, Any]:
    """Return what a report says of the solver.

    Parameters
    ----------
    found : mapping
        The report of the `Solution`.
    settings : mapping
        The method's settings, as they were used.
    objects : sequence of BakeObject
        Whose triangles they are; independent sets are given by the names of their objects.
    """
    part = {"method": found.get("method"), "settings": dict(settings), **found}
    if "independent_sets" in found:
        part["independent_sets"] = [_named(block, objects) for block in found["independent_sets"]]
    return part


def _named(block: Mapping[str, Any], objects: Sequence[BakeObject]) -> dict[str, Any]:
    """Replace the triangles of an independent set by the names of the objects they belong to."""
    firsts = [item.first for item in objects]
    owners = sorted({bisect_right(firsts, triangle) - 1 for triangle in block["triangles"]})
    names = list(dict.fromkeys(objects[owner].name for owner in owners))
    return {"objects": names, **{key: value for key, value in block.items() if key != "triangles"}}


def _said(warning: BakeWarning) -> dict[str, str]:
    return {"name": warning.name, "message": warning.message}


def _file(file: LightmapFile) -> dict[str, Any]:
    """Return an image's entry: its name, and its scale if it has one."""
    return {"image": file.path} if file.scale is None else {"image": file.path, "scale": file.scale}


def thinned(history: Sequence[T], most: int = MAX_HISTORY) -> list[T]:
    """Return at most `most` entries of a history, evenly spaced, the first and the last among them."""
    if len(history) <= most:
        return list(history)
    return [history[round(place * (len(history) - 1) / (most - 1))] for place in range(most)]


def _plain(value: Any) -> Any:
    """Turn NumPy's numbers and arrays into what JSON knows; it knows no infinity and no NaN."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
