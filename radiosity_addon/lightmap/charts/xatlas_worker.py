"""xatlas, imported only here: runs in this process, or in a separate one while a window is open.

xatlas keeps Python's lock for as long as it works, 2.6 s for 16,000 triangles: called from a thread it would
freeze the window all the same. Run as a script this file is the other process; it must import nothing
of the package, whose name differs from installation to installation.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Int = NDArray[np.int64]

WORTH_A_PROCESS = 2000
"""Triangles that take about as long as a process takes to start, and less than a frame."""

TIMEOUT = 600.0
"""Seconds after which the other process is given up, and the work done in this one."""

LONGEST_CHART = 2048
"""Texels to which xatlas scales a longer chart to pack it, where all charts take about 1024 × 1024.

It draws each chart's bounding box as a bitmap whose size in bits it counts in 32 bits: a thin frame whose
sides are 100,000 times as long as wide made it write outside of it, and end the process. The scale is
of no consequence, as charts are brought to their own scale later.
"""


def run_xatlas(vertices: Float, faces: Int) -> tuple[Any, Float, Int]:
    """Cut a mesh into charts in this process.

    vertices (v, 3): At a scale where triangles are about 1 in area, welded.
    faces (n, 3) int64.
    Returns to be kept a while: destroyed right after its work it may hang.
    Returns uv (n, 3, 2): Stretched along u and v, each chart otherwise; charts may lie over each other.
    Returns chart (n,) int64: −1 for faces that xatlas left out.
    """
    import xatlas

    atlas = xatlas.Atlas()
    atlas.add_mesh(vertices.astype(np.float32), faces.astype(np.uint32))
    # Its packing is not used: make it quick, and do not let it turn charts twice.
    packing = xatlas.PackOptions()
    packing.rotate_charts = False
    packing.bilinear = False
    packing.max_chart_size = LONGEST_CHART
    atlas.generate(xatlas.ChartOptions(), packing)
    _, indices, uv = atlas[0]
    _, chart_of_vertex = atlas.get_mesh_vertex_assignment(0)
    chart = chart_of_vertex[indices[:, 0]].astype(np.int64)
    chart[chart == np.iinfo(np.uint32).max] = -1
    scale = np.array((max(atlas.width, 1), max(atlas.height, 1)), dtype=np.float64)
    return atlas, uv[indices].astype(np.float64) * scale, chart


def run_apart(vertices: Float, faces: Int) -> tuple[Float, Int] | None:
    """Cut a mesh into charts in a process of its own; None if none can be started.

    Parameters and results are those of `run_xatlas`, to the last bit.
    """
    try:
        done = subprocess.run(
            [sys.executable, str(Path(__file__))],
            input=_packed(vertices, faces),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            timeout=TIMEOUT,
            check=True,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        uv, chart = _unpacked(done.stdout)
    except (OSError, subprocess.SubprocessError, ValueError, EOFError):
        return None
    return (uv, chart) if len(chart) == len(faces) else None


def _packed(*arrays: NDArray[Any]) -> bytes:
    file = io.BytesIO()
    for array in arrays:
        np.save(file, array, allow_pickle=False)
    return file.getvalue()


def _unpacked(data: bytes) -> tuple[NDArray[Any], NDArray[Any]]:
    file = io.BytesIO(data)
    return np.load(file, allow_pickle=False), np.load(file, allow_pickle=False)


def _answer() -> None:
    """Read a mesh from standard input and write its charts to standard output."""
    answer = os.dup(1)
    os.dup2(2, 1)  # other output must not be mixed with it
    atlas, uv, chart = run_xatlas(*_unpacked(sys.stdin.buffer.read()))
    with os.fdopen(answer, "wb") as file:
        file.write(_packed(uv, chart))
    del uv, chart
    # Without cleanup: destroying the atlas may hang.
    os._exit(0 if atlas is not None else 1)


if __name__ == "__main__":
    _answer()
