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
from collections.abc import Callable
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


class XatlasCrashError(Exception):
    """xatlas ended its process."""


def run_xatlas(vertices: Float, faces: Int, mesh: Int, keep: Callable[[object], None]) -> tuple[Float, Int]:
    """Cut meshes into charts in this process.

    Each mesh has an atlas of its own. Adding a second one may move the list of tasks in memory
    while a thread of xatlas reads from it: on a busy machine, one in 2,000 small atlases crashed.

    vertices (v, 3): At a scale where triangles are about 1 in area, welded.
    faces (n, 3) int64: Those of one mesh use a range of vertices of their own.
    mesh (n,) int64: Ascending.
    keep: Takes the atlases: destroyed right after its work one may hang.
    Returns uv (n, 3, 2): Stretched along u and v, each chart otherwise; charts may lie over each other.
    Returns chart (n,) int64: −1 for faces that xatlas left out.
    """
    uvs, charts, count = [], [], 0
    for part in np.split(faces, np.flatnonzero(np.diff(mesh)) + 1):
        low, high = int(part.min()), int(part.max()) + 1
        atlas, uv, chart = _cut_mesh(vertices[low:high], part - low)
        keep(atlas)
        uvs.append(uv)
        charts.append(np.where(chart >= 0, chart + count, -1))
        count = max(count, int(charts[-1].max()) + 1)
    return np.concatenate(uvs), np.concatenate(charts)


def _cut_mesh(vertices: Float, faces: Int) -> tuple[object, Float, Int]:
    """Return xatlas' atlas of a mesh, uv (n, 3, 2) and chart (n,), −1 where a face was left out."""
    import xatlas

    atlas = xatlas.Atlas()
    atlas.add_mesh(vertices.astype(np.float32), faces.astype(np.uint32))
    # Its packing is not used: make it quick, and do not let it turn charts twice.
    packing = xatlas.PackOptions()
    packing.rotate_charts = False
    packing.bilinear = False
    packing.max_chart_size = LONGEST_CHART
    packing.texels_per_unit = TEXELS_PER_UNIT
    atlas.generate(xatlas.ChartOptions(), packing)
    _, indices, uv = atlas[0]
    _, chart_of_vertex = atlas.get_mesh_vertex_assignment(0)
    chart = chart_of_vertex[indices[:, 0]].astype(np.int64)
    chart = np.where(chart == np.iinfo(np.uint32).max, -1, chart)
    scale = np.array((max(atlas.width, 1), max(atlas.height, 1)), dtype=np.float64)
    return atlas, uv[indices].astype(np.float64) * scale, chart


class XatlasProcess:
    """xatlas in a process of its own, started when it is first needed."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._closed, self._lock = False, threading.Lock()

    def run(self, vertices: Float, faces: Int, mesh: Int) -> tuple[Float, Int] | None:
        """Cut meshes into charts; None if the process does not start.

        Parameters and results are those of `run_xatlas`, to the last bit. Raises `XatlasCrashError` if the
        process ended, or was ended, while it worked.
        """
        timer, started = None, False
        try:
            with self._lock:
                if self._closed:
                    return None
                first, process = self._process is None, self._process or start_process()
                self._process = process
            timer = threading.Timer(TIMEOUT, process.kill)
            timer.daemon = True
            timer.start()
            assert process.stdin is not None
            assert process.stdout is not None
            if first:
                _read(process.stdout)
            started = True
            _write(process.stdin, _packed(vertices, faces, mesh))
            uv, chart = _unpacked(_read(process.stdout), 2)
        except (OSError, ValueError, EOFError) as error:
            self.close()
            if started:
                raise XatlasCrashError from error
            return None
        finally:
            if timer is not None:
                timer.cancel()
        return uv, chart

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
    """Say that it works, then read meshes and write their charts, until the input ends."""
    importlib.import_module("xatlas")
    resting = importlib.import_module("delayed_release").DelayedRelease()
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # other output must not be mixed with it
    _write(answer, b"")
    while True:
        try:
            vertices, faces, mesh = _unpacked(_read(sys.stdin.buffer), 3)
        except EOFError:
            # Without cleanup: destroying an atlas may hang.
            os._exit(0)
        _write(answer, _packed(*run_xatlas(vertices, faces, mesh, resting.keep)))


if __name__ == "__main__":
    _answer()
