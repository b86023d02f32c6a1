"""Cutting meshes into charts: xatlas, here or in other processes, and its fallback."""

from __future__ import annotations

import queue
import threading
import time

import numpy as np
from numpy.typing import NDArray

from ...base import Cancelled
from ...numerics import thread_count
from .box_charts import box_charts
from .delayed_release import DelayedRelease
from .xatlas_worker import XatlasCrashError, XatlasProcess, run_xatlas

Float = NDArray[np.float64]
Int = NDArray[np.int64]

WORTH_PROCESSES = 20_000
"""More triangles are cut in other processes: starting takes time. Next to a window all are, for a crash
of xatlas, which is rare, would take unsaved work with it."""

resting = DelayedRelease()
"""The latest of xatlas' atlases: destroyed right after their work they may hang."""


def grow_charts(vertices: Float, faces: Int, mesh: Int) -> tuple[Float, Int]:
    """Cut meshes into charts with xatlas.

    vertices (v, 3): At a scale where triangles are about 1 in area, welded.
    faces (n, 3) int64: Those of one mesh use a range of vertices of their own.
    mesh (n,) int64: Ascending.
    Returns uv (n, 3, 2): Stretched along u and v, each chart otherwise; charts may lie over each other.
    Returns chart (n,) int64: −1 for faces that xatlas left out.
    """
    return run_xatlas(vertices, faces, mesh, resting.keep)


class PatientGrower:
    """Grows charts with xatlas until an object has taken too long, and then by directions.

    May be called from as many threads at once as it has processes. Leaving its context ends these.

    gave_up: The objects that took too long.
    crashed: Those that ended xatlas' process twice.
    """

    def __init__(self, seconds: float, triangles: int = 0, threads: int = 1, in_window: bool = False) -> None:
        """Start no process before it is needed, and none for few triangles without a window."""
        processes = thread_count(threads) if in_window or triangles > WORTH_PROCESSES else 0
        self.gave_up: set[int] = set()
        self.crashed: set[int] = set()
        self._seconds, self._lock, self._closed = seconds, threading.Lock(), False
        self._spent: dict[int, float] = {}
        self._processes = [XatlasProcess() for _ in range(processes)]
        self._idle: queue.SimpleQueue[XatlasProcess] = queue.SimpleQueue()
        for process in self._processes:
            self._idle.put(process)

    def __enter__(self) -> PatientGrower:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the processes, whatever they are doing; calls that wait for them raise `Cancelled`."""
        with self._lock:
            self._closed = True
            processes = list(self._processes)
        for process in processes:
            process.close()

    def __call__(self, vertices: Float, faces: Int, mesh: Int) -> tuple[Float, Int]:
        """Cut objects into charts; see `grow_charts`."""
        with self._lock:
            late = {number for number, spent in self._spent.items() if spent >= self._seconds}
        if self._seconds <= 0:
            late.update(mesh.tolist())
        by_axis = np.isin(mesh, list(late))
        uv, chart = np.zeros((len(faces), 3, 2)), np.full(len(faces), -1, dtype=np.int64)
        if by_axis.any():
            uv[by_axis], chart[by_axis] = box_charts(vertices, faces[by_axis])
            self.gave_up.update(np.unique(mesh[by_axis]).tolist())
        rest = ~by_axis
        if rest.any():
            started = time.perf_counter()
            uv[rest], grown = self._grown(vertices, faces[rest], mesh[rest])
            chart[rest] = np.where(grown >= 0, grown + chart.max() + 1, -1)
            self._count_time(mesh[rest], time.perf_counter() - started)
        return uv, chart

    def _grown(self, vertices: Float, faces: Int, mesh: Int) -> tuple[Float, Int]:
        """Cut in a process; objects one by one after a crash, and by directions after two."""
        if not self._processes:
            return grow_charts(vertices, faces, mesh)
        try:
            return self._run(vertices, faces, mesh)
        except XatlasCrashError:
            pass
        uv, chart = np.empty((len(faces), 3, 2)), np.empty(len(faces), dtype=np.int64)
        count = 0
        for number in np.unique(mesh).tolist():
            rows = mesh == number
            try:
                uv[rows], own = self._run(vertices, faces[rows], mesh[rows])
            except XatlasCrashError:
                uv[rows], own = box_charts(vertices, faces[rows])
                self.crashed.add(number)
            chart[rows] = np.where(own >= 0, own + count, -1)
            count = max(count, int(chart[rows].max()) + 1)
        return uv, chart

    def _run(self, vertices: Float, faces: Int, mesh: Int) -> tuple[Float, Int]:
        """Cut in a process, or here if none starts; raises `XatlasCrashError`, with a new process ready."""
        process = self._idle.get()
        try:
            found = process.run(vertices, faces, mesh)
        except XatlasCrashError:
            process = self._another()
            if not self._closed:
                raise
            found = None
        finally:
            self._idle.put(process)
        if self._closed:
            raise Cancelled
        return grow_charts(vertices, faces, mesh) if found is None else found

    def _another(self) -> XatlasProcess:
        process = XatlasProcess()
        with self._lock:
            self._processes.append(process)
            closed = self._closed
        if closed:
            process.close()
        return process

    def _count_time(self, mesh: Int, seconds: float) -> None:
        """Share time out by triangles."""
        numbers, counts = np.unique(mesh, return_counts=True)
        with self._lock:
            for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
                self._spent[number] = self._spent.get(number, 0.0) + seconds * count / len(mesh)
