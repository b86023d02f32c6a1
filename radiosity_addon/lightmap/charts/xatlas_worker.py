"""xatlas, imported only here: runs in this process, or in separate ones while others go on.

xatlas keeps Python's lock for as long as it works, 0.4 s for 8,000 triangles: called from a thread it would
freeze the window all the same. Run as a script this file is the other process; it must import nothing
of the package, whose name differs from installation to installation.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Int = NDArray[np.int64]

TIMEOUT = 600.0
"""Seconds after which the other process is given up, and the work done in this one."""

LONGEST_CHART = 2048
"""Texels to which xatlas scales a longer chart to pack it.

It draws each chart's bounding box as a bitmap whose size in bits it counts in 32 bits: a thin frame whose
sides are 100,000 times as long as wide made it write outside of it, and end the process. The scale is
of no consequence, as charts are brought to their own scale later.
"""

TEXELS_PER_UNIT = 0.25
"""At which xatlas packs. Its packing is not used, and takes longer than cutting at the scale it chooses."""


def run_xatlas(vertices: Float, faces: Int, mesh: Int) -> tuple[Any, Float, Int]:
    """Cut meshes into charts in this process.

    vertices (v, 3): At a scale where triangles are about 1 in area, welded.
    faces (n, 3) int64: Those of one mesh use a range of vertices of their own.
    mesh (n,) int64: Ascending.
    Returns to be kept a while: destroyed right after its work it may hang.
    Returns uv (n, 3, 2): Stretched along u and v, each chart otherwise; charts may lie over each other.
    Returns chart (n,) int64: −1 for faces that xatlas left out.
    """
    import xatlas

    atlas = xatlas.Atlas()
    parts = np.split(faces, np.flatnonzero(np.diff(mesh)) + 1)
    for part in parts:
        low, high = int(part.min()), int(part.max()) + 1
        atlas.add_mesh(vertices[low:high].astype(np.float32), (part - low).astype(np.uint32))
    # Its packing is not used: make it quick, and do not let it turn charts twice.
    packing = xatlas.PackOptions()
    packing.rotate_charts = False
    packing.bilinear = False
    packing.max_chart_size = LONGEST_CHART
    packing.texels_per_unit = TEXELS_PER_UNIT
    atlas.generate(xatlas.ChartOptions(), packing)
    scale = np.array((max(atlas.width, 1), max(atlas.height, 1)), dtype=np.float64)
    uvs, charts, count = [], [], 0
    for number in range(len(parts)):
        _, indices, uv = atlas[number]
        _, chart_of_vertex = atlas.get_mesh_vertex_assignment(number)
        chart = chart_of_vertex[indices[:, 0]].astype(np.int64)
        left_out = chart == np.iinfo(np.uint32).max
        chart = np.where(left_out, -1, chart - chart.min() + count)
        count = max(count, int(chart.max()) + 1)
        uvs.append(uv[indices].astype(np.float64) * scale)
        charts.append(chart)
    return atlas, np.concatenate(uvs), np.concatenate(charts)


class XatlasProcess:
    """xatlas in a process of its own, started when it is first needed."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._closed, self._lock = False, threading.Lock()

    def run(self, vertices: Float, faces: Int, mesh: Int) -> tuple[Float, Int] | None:
        """Cut meshes into charts; None if the process cannot be started, or ended.

        Parameters and results are those of `run_xatlas`, to the last bit.
        """
        timer = None
        try:
            with self._lock:
                if self._closed:
                    return None
                process = self._process = self._process or start_process()
            timer = threading.Timer(TIMEOUT, process.kill)
            timer.daemon = True
            timer.start()
            assert process.stdin is not None
            assert process.stdout is not None
            _write(process.stdin, _packed(vertices, faces, mesh))
            uv, chart = _unpacked(_read(process.stdout), 2)
        except (OSError, ValueError, EOFError):
            self.close()
            return None
        finally:
            if timer is not None:
                timer.cancel()
        return (uv, chart) if len(chart) == len(faces) else None

    def close(self) -> None:
        """End the process, whatever it is doing."""
        with self._lock:
            self._closed = True
            process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):  # what was not read yet
                    pipe.close()


def start_process() -> subprocess.Popen[bytes]:
    """Start a worker that reads charts to cut from its input."""
    return subprocess.Popen(
        [sys.executable, str(Path(__file__))],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
    )


def _write(file: IO[bytes], data: bytes) -> None:
    file.write(len(data).to_bytes(8, "little") + data)
    file.flush()


def _read(file: IO[bytes]) -> bytes:
    """Read what `_write` wrote; raises EOFError at the end."""
    size = file.read(8)
    data = file.read(int.from_bytes(size, "little"))
    if len(size) < 8 or len(data) < int.from_bytes(size, "little"):
        raise EOFError
    return data


def _packed(*arrays: NDArray[Any]) -> bytes:
    file = io.BytesIO()
    for array in arrays:
        np.save(file, array, allow_pickle=False)
    return file.getvalue()


def _unpacked(data: bytes, count: int) -> tuple[NDArray[Any], ...]:
    file = io.BytesIO(data)
    return tuple(np.load(file, allow_pickle=False) for _ in range(count))


def _answer() -> None:
    """Read meshes from standard input and write their charts to standard output, until the input ends."""
    resting = importlib.import_module("delayed_release").DelayedRelease()
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # other output must not be mixed with it
    while True:
        try:
            meshes = _unpacked(_read(sys.stdin.buffer), 3)
        except EOFError:
            # Without cleanup: destroying an atlas may hang.
            os._exit(0)
        atlas, uv, chart = run_xatlas(*meshes)
        _write(answer, _packed(uv, chart))
        resting.keep(atlas)
        del atlas, uv, chart


if __name__ == "__main__":
    _answer()
