"""What a bake says of itself: report.json, and the panel's figures."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .bake_scene import LIGHTMAP_UV_LAYER, BakeResult
from .errors import BakeError

VERSION = 1
_SOLVER_KEYS = ("elements", "links", "rays", "iterations", "residual", "power_W", "closure_area_mean")


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
    def of(cls, result: BakeResult, files: Sequence[LightmapFile], seconds: dict[str, float]) -> BakeReport:
        """Report a bake.

        Parameters
        ----------
        result : BakeResult
        files : sequence of LightmapFile
            Parallel to `result.pages`.
        seconds : dict of str to float
            Wall-clock time of every stage, those outside the pipeline included.
        """
        objects = []
        for baked in result.objects:
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
            objects.append(entry)
        solver = {key: result.solver[key] for key in _SOLVER_KEYS if key in result.solver}
        return cls(
            {
                "version": VERSION,
                "objects": objects,
                "solver": _plain(solver),
                "warnings": [{"name": w.name, "message": w.message} for w in result.warnings],
                "seconds": {stage: round(float(taken), 4) for stage, taken in seconds.items()},
            }
        )

    def as_dict(self) -> dict[str, Any]:
        """The report as report.json holds it."""
        return self.data

    def write(self, path: Path) -> None:
        """Write the report as JSON, over an older one only once it is whole.

        Raises
        ------
        BakeError
            If it cannot be written.
        """
        aside = path.with_name(f".{path.name}.{os.getpid()}.part")
        try:
            aside.write_text(json.dumps(self.data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
            aside.replace(path)
        except OSError as error:
            aside.unlink(missing_ok=True)
            raise BakeError(f"cannot write the report '{path}': {error.strerror}") from error


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
