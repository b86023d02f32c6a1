"""Charts made in another process, beside a window, are those made in this one."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest
import xatlas

from radiosity_addon.base import Cancelled, Progress, Status
from radiosity_addon.lightmap.charts import cut_charts, growers, xatlas_worker
from radiosity_addon.lightmap.charts.box_charts import box_charts
from radiosity_addon.lightmap.charts.cut_charts import Charts, unwrap
from radiosity_addon.lightmap.charts.xatlas_worker import XatlasProcess
from radiosity_addon.numerics import numbered
from tests.unit.lightmap_meshes import uv_sphere

Mesh = tuple[np.ndarray, np.ndarray]


@pytest.fixture(scope="module")
def bowl() -> Mesh:
    """A wavy sheet of 2,048 triangles, each about 1 in area."""
    side = 33
    x, y = np.meshgrid(np.arange(side, dtype=float), np.arange(side, dtype=float), indexing="ij")
    vertices = 1.4 * np.stack([x, y, 3 * np.sin(x / 4) * np.cos(y / 5)], axis=-1).reshape(-1, 3)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1)
    quads = np.stack([corner, corner + side, corner + side + 1, corner + 1], axis=-1)
    return vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


@pytest.fixture
def process() -> Iterator[XatlasProcess]:
    process = XatlasProcess()
    yield process
    process.close()


def two_of(bowl: Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the vertices, faces and numbers of two meshes, the second one mirrored."""
    vertices, faces = bowl
    both = np.concatenate([vertices, vertices * (1, 1, -1)])
    return both, np.concatenate([faces, faces + len(vertices)]), np.repeat([0, 5], len(faces))


def test_another_process_gives_the_same_charts_time_after_time(bowl: Mesh, process: XatlasProcess) -> None:
    meshes = two_of(bowl)
    uv, chart = growers.grow_charts(*meshes)
    for _ in range(2):
        found = process.run(*meshes)
        assert found is not None
        np.testing.assert_array_equal(found[0], uv)
        np.testing.assert_array_equal(found[1], chart)


def test_meshes_cut_together_have_the_charts_that_they_have_alone(bowl: Mesh) -> None:
    vertices, faces, mesh = two_of(bowl)
    _, chart = growers.grow_charts(vertices, faces, mesh)
    assert not set(chart[mesh == 0]) & set(chart[mesh == 5])
    for number in (0, 5):
        of = mesh == number
        alone = growers.grow_charts(vertices, faces[of], mesh[of])[1]
        np.testing.assert_array_equal(numbered(chart[of]), numbered(alone))


def test_no_atlas_has_a_second_mesh(bowl: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    """Adding it may crash xatlas."""
    added: list[xatlas.Atlas] = []

    class RecordingAtlas(xatlas.Atlas):
        def add_mesh(self, *mesh: object) -> None:
            added.append(self)
            super().add_mesh(*mesh)

    monkeypatch.setattr(xatlas, "Atlas", RecordingAtlas)
    growers.grow_charts(*two_of(bowl))
    assert len(added) == 2
    assert added[0] is not added[1]


@pytest.mark.parametrize(
    ("triangles", "in_window", "processes"),
    [(12, True, 3), (2001, True, 3), (20_000, False, 0), (20_001, False, 3)],
)
def test_long_work_and_all_next_to_a_window_has_processes(
    bowl: Mesh, triangles: int, in_window: bool, processes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[XatlasProcess] = []
    monkeypatch.setattr(growers, "XatlasProcess", lambda: made.append(XatlasProcess()) or made[-1])
    with growers.PatientGrower(60.0, triangles, threads=3, in_window=in_window):
        assert len(made) == processes


@pytest.mark.parametrize("program", ["/nowhere/python", "/bin/false", "/bin/true"])
def test_without_another_process_the_work_is_done_here(
    bowl: Mesh, program: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", program)
    meshes = two_of(bowl)
    with growers.PatientGrower(60.0, 10**6, threads=1) as grower:
        uv, chart = grower(*meshes)
    expected = growers.grow_charts(*meshes)
    np.testing.assert_array_equal(uv, expected[0])
    np.testing.assert_array_equal(chart, expected[1])


# Says that it works, reads a little of its input, and crashes.
CRASHING = "import os; os.write(1, bytes(8)); os.read(0, 8); os.abort()"


def crash_some_processes(
    monkeypatch: pytest.MonkeyPatch, crashing: set[int]
) -> list[subprocess.Popen[bytes]]:
    """Make the processes of these numbers, in the order they are started, crash; return those started."""
    started: list[subprocess.Popen[bytes]] = []
    start = xatlas_worker.start_process

    def started_process() -> subprocess.Popen[bytes]:
        if len(started) in crashing:
            pipe = subprocess.PIPE
            started.append(subprocess.Popen([sys.executable, "-c", CRASHING], stdin=pipe, stdout=pipe))
        else:
            started.append(start())
        return started[-1]

    monkeypatch.setattr(xatlas_worker, "start_process", started_process)
    # In this process a crash would end Blender.
    monkeypatch.setattr(growers, "grow_charts", None)
    return started


def test_a_process_that_crashes_is_replaced(bowl: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    meshes = two_of(bowl)
    expected = growers.grow_charts(*meshes)
    started = crash_some_processes(monkeypatch, {0})
    with growers.PatientGrower(60.0, 12, threads=1, in_window=True) as grower:
        uv, chart = grower(*meshes)
    assert len(started) == 2
    assert all(process.poll() is not None for process in started)
    np.testing.assert_array_equal(uv, expected[0])
    np.testing.assert_array_equal(chart, expected[1])
    assert not grower.crashed


def test_an_object_that_crashes_xatlas_twice_is_cut_by_direction(
    bowl: Mesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other object of its batch has the charts that it has alone."""
    vertices, faces, mesh = two_of(bowl)
    expected = growers.grow_charts(vertices, faces, mesh)
    by_direction = box_charts(vertices, faces[mesh == 0])
    started = crash_some_processes(monkeypatch, {0, 1})
    with growers.PatientGrower(60.0, 12, threads=1, in_window=True) as grower:
        uv, chart = grower(vertices, faces, mesh)
    assert grower.crashed == {0}
    assert len(started) == 3
    np.testing.assert_array_equal(uv[mesh == 0], by_direction[0])
    np.testing.assert_array_equal(uv[mesh == 5], expected[0][mesh == 5])
    assert not set(chart[mesh == 0]) & set(chart[mesh == 5])


def test_canceled_while_a_process_works_nothing_is_left_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """The process never answers; the work ends nevertheless, and the process with it."""
    started: list[subprocess.Popen[bytes]] = []

    def deaf() -> subprocess.Popen[bytes]:
        program = [sys.executable, "-c", "import time; time.sleep(600)"]
        started.append(subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE))
        return started[-1]

    def cancel(_: Status) -> None:
        if started:
            raise Cancelled

    monkeypatch.setattr(xatlas_worker, "start_process", deaf)
    triangles, polygon = uv_sphere(6, 8)
    with growers.PatientGrower(60.0, 10**6, threads=2) as grower, pytest.raises(Cancelled):
        unwrap(triangles, polygon, grower, Progress(cancel), threads=2, abort=grower.close)
    assert [process.poll() is not None for process in started] == [True]


@pytest.mark.parametrize("threads", [2, 3])
def test_charts_are_the_same_bytes_with_any_number_of_processes(
    threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(growers, "WORTH_PROCESSES", 0)
    monkeypatch.setattr(cut_charts, "BATCH", 200)
    parts = [uv_sphere(6, 8 + k) for k in range(8)]
    triangles = np.concatenate([part[0] for part in parts])
    polygon = np.concatenate([part[1] for part in parts])
    owner = np.repeat(np.arange(8), [len(part[0]) for part in parts])

    def charts(count: int) -> Charts:
        with growers.PatientGrower(60.0, len(triangles), count) as grower:
            return unwrap(triangles, polygon, grower, threads=count, owner=owner)

    one, several = charts(1), charts(threads)
    np.testing.assert_array_equal(one.uv, several.uv)
    np.testing.assert_array_equal(one.chart, several.chart)
    here = unwrap(triangles, polygon, growers.grow_charts, owner=owner)
    np.testing.assert_array_equal(one.uv, here.uv)


@pytest.mark.parametrize("width", [1e-3, 1e-5, 1e-6])
def test_a_frame_of_thin_strips_becomes_charts(width: float, process: XatlasProcess) -> None:
    """Unlimited, the bitmap in which xatlas packs it takes more bits than it can count."""
    outer = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    inner = outer * (1 - 2 * width) + width
    corners = np.column_stack((np.concatenate([outer, inner]), np.zeros(8)))
    side, after = np.arange(4), np.roll(np.arange(4), -1)
    halves = [np.stack([side, after, 4 + after], axis=1), np.stack([side, 4 + after, 4 + side], axis=1)]
    triangles = corners[np.concatenate(halves)]
    # Where it is unlimited this ends the process, so another one tries first.
    vertices = (corners - 0.5) / np.sqrt(0.5 * width)
    assert process.run(vertices, np.concatenate(halves), np.zeros(8, dtype=np.int64)) is not None
    charts = unwrap(triangles, np.tile(side, 2), growers.grow_charts)
    assert (charts.chart >= 0).all()
    edges = charts.uv[:, 1:] - charts.uv[:, :1]
    area = 0.5 * np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    np.testing.assert_allclose(area.sum(), 4 * width, rtol=0.01)
