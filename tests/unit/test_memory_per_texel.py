"""What parts of a bake take of memory for each texel when arrays are in files: nothing for each ray."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from radiosity_addon.bake.texel_memory import LIT_BYTES
from radiosity_addon.lightmap.points.interpolation import Interpolation
from radiosity_addon.lightmap.points.point_grid import PointGrid
from radiosity_addon.lightmap.texels.occlusion import Crossings
from radiosity_addon.lightmap.transport import gather_links, source_means, sweeps
from radiosity_addon.lightmap.transport.gather_links import GatherLinks
from radiosity_addon.lightmap.transport.sub_cells import SubCells
from radiosity_addon.lightmap.transport.sweeps import TexelLight, TexelTransport, sweep
from radiosity_addon.numerics import scratch as scratch_module
from radiosity_addon.numerics.scratch import Scratch, is_in_file, trim
from radiosity_addon.solver import PointLight, SolverSettings, solve
from radiosity_addon.solver.gather.bright_patches import AimedRays
from radiosity_addon.solver.gather.footprints import Footprints
from radiosity_addon.solver.gather.hit_numbers import NOTHING
from tests.rooms import box_room, gray_scene
from tests.unit.test_sweeps import identity, room_with_texels

COUNT = 1 << 16
AIMED = 48
"""Rays that a point aims, of 192 that it has: more than 500 bytes with all that is kept of them."""

UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture
def in_files(monkeypatch: pytest.MonkeyPatch) -> Scratch:
    """Return what puts every array of a kilobyte or more into a file."""
    monkeypatch.setattr(scratch_module, "MIN_FILE_BYTES", 1 << 10)
    return Scratch(0.0)


@contextmanager
def bytes_taken() -> Iterator[list[int]]:
    """Give a list that holds, in the end, the most memory that was taken meanwhile."""
    found: list[int] = []
    tracemalloc.start()
    try:
        yield found
        found.append(tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()


def swept(scratch: Scratch) -> TexelLight:
    """Sweep over points that all aim, every one a texel."""
    random = np.random.default_rng(3)

    def whole(width: int, dtype: type) -> np.ndarray:
        return scratch.empty((COUNT, width), dtype)

    sources, aimed, weights = whole(4, np.int32), whole(AIMED, np.int32), whole(AIMED, np.float32)
    first, point, weight = (scratch.empty(COUNT, dtype) for dtype in (np.int64, np.int32, np.float32))
    one = identity(COUNT)
    first[:], point[:], weight[:] = one.first, one.point, one.weight
    sources[:] = random.integers(0, COUNT, sources.shape)
    aimed[:] = random.integers(NOTHING, COUNT, aimed.shape)
    weights[:] = 0.1 / AIMED
    rays = AimedRays(np.arange(COUNT), aimed, weights, aimed)
    reflectance, start, lamps = (whole(3, np.float64) for _ in range(3))
    reflectance[:], start[:] = 0.5, 0.5
    lamps[:] = random.uniform(0, 1, (COUNT, 1))
    links = GatherLinks(sources, Interpolation(first, point, weight), rays)
    transport = TexelTransport(links, SubCells(np.zeros((0, 3)), []), reflectance)
    trim()
    with bytes_taken() as taken:
        light = sweep(transport, start, lamps, np.zeros((3, 3)), 3, threads=1, scratch=scratch)
    MOST.append(taken[0])
    return light


MOST: list[int] = []
"""What sweeps took at most, one after the other."""


def test_sweeps_take_no_memory_for_each_ray(in_files: Scratch, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scratch_module, "TILE", 1 << 12)
    monkeypatch.setattr(gather_links, "AIMED_ROWS", 1 << 10)
    monkeypatch.setattr(source_means, "CHUNK_HITS", 1 << 14)
    monkeypatch.setattr(sweeps, "CHUNK_HITS", 1 << 14)
    tiled = swept(in_files)
    assert MOST[-1] < LIT_BYTES * COUNT
    monkeypatch.undo()
    whole = swept(Scratch())
    for name in ("direct", "indirect", "table", "noise"):
        assert getattr(tiled, name).tobytes() == getattr(whole, name).tobytes()
    # Summed tile by tile: the last digits depend on how many tiles there are.
    assert tiled.error == pytest.approx(whole.error, rel=1e-12)


def test_aimed_rays_are_kept_in_files(in_files: Scratch) -> None:
    room, _ = box_room((2, 2, 1))
    lamp = PointLight((1.93, 1.0, 0.5), 10.0, radius=0.01)
    local = solve(gray_scene(room, 0.7, lights=[lamp]), SolverSettings(error=1e-4)).local_pass
    count, rays = 1 << 9, 192
    found = {}
    for scratch in (in_files, Scratch()):
        at = Footprints(
            np.tile([0.15, 0.8, 0.0], (count, 1)), np.tile(UP, (count, 1)), np.arange(count), scratch=scratch
        )
        into = scratch.empty((count, rays), np.int32)
        gathered = local.gather.at(
            at, at.normals, rays, local.elements.leaves_of, np.full(count, 1e-9), (into, None)
        )
        found[scratch] = gathered.aimed
    filed, kept = (found[scratch] for scratch in found)
    assert len(filed.row) == count
    for name in ("row", "sources", "weights", "element"):
        one, other = getattr(filed, name), getattr(kept, name)
        assert (is_in_file(one), is_in_file(other)) == (True, False)
        np.testing.assert_array_equal(one, other)
        assert one.dtype == other.dtype
    joined = AimedRays.joined([filed, filed], [0, count], in_files)
    assert is_in_file(joined.sources)
    np.testing.assert_array_equal(joined.row, np.arange(2 * count))


def test_points_are_put_into_cells_tile_by_tile(in_files: Scratch) -> None:
    random = np.random.default_rng(4)
    position, normal = in_files.empty((COUNT, 3)), in_files.empty((COUNT, 3))
    position[:], normal[:] = random.uniform(0, 10, position.shape), UP
    rows = np.arange(0, COUNT, 2)
    with bytes_taken() as taken:
        PointGrid(position, normal, rows, np.zeros(len(rows), dtype=np.int64), 0, 0.1, in_files)
    # Numbers in order take 8 bytes, to be sorted half as much; tiles of 65,536 points some 8 MB.
    assert taken[0] < 16 * len(rows) + 12e6


def test_states_take_a_few_bytes_a_texel() -> None:
    _, geometry = room_with_texels(size=8)
    flags = np.random.default_rng(5).random((4, COUNT)) > 0.7
    crossings = Crossings(geometry, *flags)
    with bytes_taken() as taken:
        state = crossings.state
    assert taken[0] < 5 * COUNT
    cut, touched, rim, occluded = flags
    expected = np.where(cut | rim, 1, np.where(occluded, 2, np.where(touched, 3, 0)))
    np.testing.assert_array_equal(state, expected)
