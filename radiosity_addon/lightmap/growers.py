"""Cutting meshes into charts: xatlas, which only this module imports, and what stands in for it."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from .box_charts import box_charts
from .resting import Resting

Float = NDArray[np.float64]
Int = NDArray[np.int64]

_resting = Resting()
"""The latest of xatlas' atlases: destroyed right after their work they may hang."""


def grow_charts(vertices: Float, faces: Int) -> tuple[Float, Int]:
    """Cut a mesh into charts with xatlas.

    Parameters
    ----------
    vertices : (v, 3) float64
        At a scale where triangles are about 1 in area, welded.
    faces : (n, 3) int64

    Returns
    -------
    uv : (n, 3, 2) float64
        Stretched along u and v, each chart otherwise; charts may lie over each other.
    chart : (n,) int64
        −1 for faces that xatlas left out.
    """
    import xatlas

    atlas = xatlas.Atlas()
    atlas.add_mesh(vertices.astype(np.float32), faces.astype(np.uint32))
    # Its packing is not used: make it quick, and do not let it turn charts twice.
    packing = xatlas.PackOptions()
    packing.rotate_charts = False
    packing.bilinear = False
    atlas.generate(xatlas.ChartOptions(), packing)
    _, indices, uv = atlas[0]
    _, chart_of_vertex = atlas.get_mesh_vertex_assignment(0)
    chart = chart_of_vertex[indices[:, 0]].astype(np.int64)
    chart[chart == np.iinfo(np.uint32).max] = -1
    scale = np.array((max(atlas.width, 1), max(atlas.height, 1)), dtype=np.float64)
    _resting.keep(atlas)
    return uv[indices].astype(np.float64) * scale, chart


class PatientGrower:
    """Grows charts with xatlas until an object has taken too long, and then by directions.

    Attributes
    ----------
    gave_up : bool
        Whether it came to that.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds, self._spent = seconds, 0.0
        self.gave_up = False

    def __call__(self, vertices: Float, faces: Int) -> tuple[Float, Int]:
        """Cut a mesh into charts; see `grow_charts`."""
        if self._spent >= self._seconds:
            self.gave_up = True
            return box_charts(vertices, faces)
        started = time.perf_counter()
        grown = grow_charts(vertices, faces)
        self._spent += time.perf_counter() - started
        return grown
