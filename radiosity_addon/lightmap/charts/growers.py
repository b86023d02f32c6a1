"""Cutting meshes into charts: xatlas, and its fallback."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from .box_charts import box_charts
from .delayed_release import DelayedRelease
from .xatlas_worker import WORTH_A_PROCESS, run_apart, run_xatlas

Float = NDArray[np.float64]
Int = NDArray[np.int64]

resting = DelayedRelease()
"""The latest of xatlas' atlases: destroyed right after their work they may hang."""


def grow_charts(vertices: Float, faces: Int, apart: bool = False) -> tuple[Float, Int]:
    """Cut a mesh into charts with xatlas.

    vertices (v, 3): At a scale where triangles are about 1 in area, welded.
    faces (n, 3) int64.
    apart: Whether long work is done in another process, as a window is drawn or other threads work meanwhile.
    Returns uv (n, 3, 2): Stretched along u and v, each chart otherwise; charts may lie over each other.
    Returns chart (n,) int64: −1 for faces that xatlas left out.
    """
    if apart and len(faces) > WORTH_A_PROCESS:
        grown = run_apart(vertices, faces)
        if grown is not None:
            return grown
    atlas, uv, chart = run_xatlas(vertices, faces)
    resting.keep(atlas)
    return uv, chart


class PatientGrower:
    """Grows charts with xatlas until an object has taken too long, and then by directions.

    gave_up: Whether it came to that.
    """

    def __init__(self, seconds: float, apart: bool = False) -> None:
        self._seconds, self._spent, self._apart = seconds, 0.0, apart
        self.gave_up = False

    def __call__(self, vertices: Float, faces: Int) -> tuple[Float, Int]:
        """Cut a mesh into charts; see `grow_charts`."""
        if self._spent >= self._seconds:
            self.gave_up = True
            return box_charts(vertices, faces)
        started = time.perf_counter()
        grown = grow_charts(vertices, faces, self._apart)
        self._spent += time.perf_counter() - started
        return grown
