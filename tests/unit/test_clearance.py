"""Clear texels need no probes: probing them anyway finds nothing."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from radiosity_addon.lightmap.texels import clearance, occlusion
from radiosity_addon.lightmap.texels.clearance import clear_texels
from radiosity_addon.lightmap.texels.occlusion import HOOD, OUTSET, find_crossings
from radiosity_addon.lightmap.texels.texel_geometry import TexelGeometry
from radiosity_addon.rays.caster import SIGHT_LIFT
from radiosity_addon.rays.embree import EmbreeCaster
from tests.rooms import gray_scene, rectangle, solid_box, sphere
from tests.unit.texel_scenes import QUAD_UV, texel_geometry

SIZE = 48


def turned(triangles: np.ndarray, seed: int) -> np.ndarray:
    """Turn and move a scene: cells are along the axes, surfaces need not be."""
    axes, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    axes *= np.sign(np.linalg.det(axes))
    return np.asarray(triangles @ axes.T + (0.3, -1.0, 2.0))


def setting(*others: np.ndarray, n: int = 1, seed: int | None = None) -> tuple[TexelGeometry, EmbreeCaster]:
    """A floor of texels over the unit square, of n × n quads, and things that have no lightmap."""
    floor = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), n)
    triangles = np.concatenate([floor, *others])
    uv = np.zeros((len(triangles), 3, 2), dtype=np.float32)
    uv[: len(floor)] = floor[:, :, :2] if n > 1 else QUAD_UV
    pages = np.full(len(triangles), -1)
    pages[: len(floor)] = 0
    if seed is not None:
        triangles = turned(triangles, seed)
    scene = gray_scene(triangles)
    return texel_geometry(scene, uv, SIZE, pages), EmbreeCaster(triangles)


def clear(geometry: TexelGeometry, caster: EmbreeCaster) -> np.ndarray:
    return clear_texels(geometry, OUTSET, HOOD, SIGHT_LIFT * caster.surface_offset)


def clutter(seed: int) -> list[np.ndarray]:
    """Boxes on the floor and over it, thin sheets close above, a ball in it, a wall across it."""
    rng = np.random.default_rng(seed)
    low = rng.uniform((0, 0, -0.05), (0.9, 0.9, 0.02), (4, 3))
    boxes = [solid_box(corner, corner + rng.uniform(0.01, 0.2, 3)) for corner in low]
    sheets = [
        rectangle((*rng.uniform(0, 0.8, 2), rng.choice([1e-3, 4e-3])), (0.15, 0, 0), (0, 0.1, 0))
        for _ in range(2)
    ]
    needle = np.array([[[0.21, 0.33, 0.001], [0.2101, 0.33, 0.001], [0.7, 0.7, 1.0]]])
    ball = sphere(3) * 0.05 + (*rng.uniform(0.2, 0.8, 2), 0.02)
    wall = rectangle((rng.uniform(0.1, 0.9), -1, -1), (0.05, 3, 0), (0, 0.3, 2))
    return [*boxes, *sheets, needle, ball, wall]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("n", [1, 40])
def test_probes_find_the_same_where_clear_texels_are_left_out(
    seed: int, n: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    geometry, caster = setting(*clutter(seed), n=n, seed=seed if seed % 2 else None)
    found = find_crossings(geometry, caster)
    some = clear(geometry, caster)
    rays = caster.rays
    monkeypatch.setattr(occlusion, "clear_texels", lambda of, *_: np.zeros(len(of), dtype=bool))
    every = find_crossings(geometry, caster)
    assert rays < caster.rays - rays
    assert some.mean() > 0.2
    for field in dataclasses.fields(every):
        mask = getattr(every, field.name)
        np.testing.assert_array_equal(getattr(found, field.name), mask, err_msg=field.name)
    assert all(mask.any() for mask in (every.cut, every.occluded, every.rim))


@pytest.mark.parametrize("n", [1, 40])
@pytest.mark.parametrize("seed", [None, 1])
def test_an_open_floor_is_clear(n: int, seed: int | None) -> None:
    """Tessellated or not, level or not, and below a ceiling."""
    assert clear(*setting(n=n, seed=seed)).all()
    assert clear(*setting(rectangle((-1, -1, 0.5), (3, 0, 0), (0, 3, 0)), n=n, seed=seed)).all()


def test_a_floor_whose_corners_are_rounded_is_clear_still() -> None:
    """Meshes are single precision: small triangles' normals are off by more than the surface is."""
    floor = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), 40)
    uv = floor[:, :, :2].astype(np.float32)
    triangles = turned(floor, 1).astype(np.float32).astype(np.float64)
    scene = gray_scene(triangles)
    assert np.ptp(scene.face_normals, axis=0).max() > 1e-6
    geometry = texel_geometry(scene, uv, SIZE, np.zeros(len(floor), dtype=int))
    assert clear(geometry, EmbreeCaster(triangles)).mean() > 0.9


def test_where_it_would_take_too_many_pieces_nothing_is_clear(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clearance, "MAX_PIECES", 1)
    geometry, caster = setting(*(rectangle((0, 0, z), (1, 0, 0), (0, 1, 0)) for z in np.arange(1, 40) / 40))
    assert not clear(geometry, caster).any()


def test_cells_that_share_a_place_are_taken_for_full(monkeypatch: pytest.MonkeyPatch) -> None:
    geometry, caster = setting(*clutter(0))
    before = clear(geometry, caster)
    monkeypatch.setattr(clearance, "MOST_CELLS", 1 << 9)
    after = clear(geometry, caster)
    assert 0.0 < after.mean() < before.mean()
    assert not (after & ~before).any()
