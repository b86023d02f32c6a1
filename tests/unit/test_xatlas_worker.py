"""Charts made in another process, beside a window, are those made in this one."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from radiosity_addon.lightmap.charts import growers, xatlas_worker
from radiosity_addon.lightmap.charts.cut_charts import unwrap


@pytest.fixture(scope="module")
def bowl() -> tuple[np.ndarray, np.ndarray]:
    """A wavy sheet of 2,048 triangles, each about 1 in area."""
    side = 33
    x, y = np.meshgrid(np.arange(side, dtype=float), np.arange(side, dtype=float), indexing="ij")
    vertices = 1.4 * np.stack([x, y, 3 * np.sin(x / 4) * np.cos(y / 5)], axis=-1).reshape(-1, 3)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1)
    quads = np.stack([corner, corner + side, corner + side + 1, corner + 1], axis=-1)
    return vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def test_the_other_process_gives_the_same_charts(bowl) -> None:
    found = xatlas_worker.run_apart(*bowl)
    assert found is not None
    atlas, uv, chart = xatlas_worker.run_xatlas(*bowl)
    growers.resting.keep(atlas)
    np.testing.assert_array_equal(found[0], uv)
    np.testing.assert_array_equal(found[1], chart)


def test_only_long_work_that_runs_apart_starts_a_process(bowl, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def apart(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        asked.append(len(faces))
        return np.zeros((len(faces), 3, 2)), np.zeros(len(faces), dtype=np.int64)

    monkeypatch.setattr(growers, "run_apart", apart)
    vertices, faces = bowl
    growers.grow_charts(vertices, faces[:20])
    growers.grow_charts(vertices, faces)
    assert asked == []
    growers.grow_charts(vertices, faces[:20], apart=True)
    growers.grow_charts(vertices, faces, apart=True)
    assert asked == [len(faces)]


@pytest.mark.parametrize("program", ["/nowhere/python", "/bin/false", "/bin/true"])
def test_without_another_process_the_work_is_done_here(
    bowl, program: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", program)
    assert xatlas_worker.run_apart(*bowl) is None
    _, chart = growers.grow_charts(*bowl, apart=True)
    assert len(chart) == len(bowl[1])


@pytest.mark.parametrize("width", [1e-3, 1e-5, 1e-6])
def test_a_frame_of_thin_strips_becomes_charts(width: float) -> None:
    """Unlimited, the bitmap in which xatlas packs it takes more bits than it can count."""
    outer = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    inner = outer * (1 - 2 * width) + width
    corners = np.column_stack((np.concatenate([outer, inner]), np.zeros(8)))
    side, after = np.arange(4), np.roll(np.arange(4), -1)
    halves = [np.stack([side, after, 4 + after], axis=1), np.stack([side, 4 + after, 4 + side], axis=1)]
    triangles = corners[np.concatenate(halves)]
    # Where it is unlimited this ends the process, so another one tries first.
    vertices = (corners - 0.5) / np.sqrt(0.5 * width)
    assert xatlas_worker.run_apart(vertices, np.concatenate(halves)) is not None
    charts = unwrap(triangles, np.tile(side, 2), growers.grow_charts)
    assert (charts.chart >= 0).all()
    edges = charts.uv[:, 1:] - charts.uv[:, :1]
    area = 0.5 * np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    np.testing.assert_allclose(area.sum(), 4 * width, rtol=0.01)
