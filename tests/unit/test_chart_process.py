"""Charts made in another process, beside a window, are those made in this one."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from radiosity_addon.lightmap import chart_process, growers


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
    found = chart_process.run_apart(*bowl)
    assert found is not None
    atlas, uv, chart = chart_process.run_xatlas(*bowl)
    growers._resting.keep(atlas)
    np.testing.assert_array_equal(found[0], uv)
    np.testing.assert_array_equal(found[1], chart)


def test_only_a_thread_with_much_to_do_asks_for_a_process(bowl, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def apart(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        asked.append(len(faces))
        return np.zeros((len(faces), 3, 2)), np.zeros(len(faces), dtype=np.int64)

    monkeypatch.setattr(growers, "run_apart", apart)
    vertices, faces = bowl
    growers.grow_charts(vertices, faces[:20])
    growers.grow_charts(vertices, faces)
    assert asked == []
    with ThreadPoolExecutor(1) as thread:
        thread.submit(growers.grow_charts, vertices, faces[:20]).result()
        thread.submit(growers.grow_charts, vertices, faces).result()
    assert asked == [len(faces)]


@pytest.mark.parametrize("program", ["/nowhere/python", "/bin/false", "/bin/true"])
def test_without_another_process_the_work_is_done_here(
    bowl, program: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", program)
    assert chart_process.run_apart(*bowl) is None
    with ThreadPoolExecutor(1) as thread:
        _, chart = thread.submit(growers.grow_charts, *bowl).result()
    assert len(chart) == len(bowl[1])
