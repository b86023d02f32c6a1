"""Which of several faces in one place counts, and what is left of the others."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics.polygons import areas
from radiosity_addon.scene.coincident_pairs import coincident_pairs, tolerances
from radiosity_addon.scene.faces import Faces
from radiosity_addon.scene.opacity import ray_caster
from radiosity_addon.scene.textures import SurfaceImages
from radiosity_addon.solver import Scene
from radiosity_addon.solver.emitters.textured_emitters import emitter_groups
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from tests.rooms import box_room, gray_scene, rectangle, solid_box, sphere

X, Y, Z = np.eye(3)
UNIT = rectangle((0, 0, 0), X, Y)
POINT, UP = np.array([[0.5, 0.4, 3.0]]), -Z[None]


def scene_of(*parts: np.ndarray, emission: tuple[float, ...] = (), **more: object) -> Scene:
    triangles = np.concatenate(parts)
    glow = np.repeat(emission or [0.0] * len(parts), [len(part) for part in parts])
    return gray_scene(triangles, 0.5, glow[:, None] * np.ones(3), **{"two_sided": True, **more})


def fronts(scene: Scene) -> np.ndarray:
    """Return (t,) what is left of every front."""
    return scene.layers.own.share_of(2 * np.arange(len(scene)))


def gain(scene: Scene) -> float:
    """Return what a point above gets from all that emits, unoccluded."""
    faces = Faces(scene)
    lamps = emitter_groups(scene, faces, ray_caster(scene))
    return sum(float(lamp.unit_irradiance(POINT, UP)[0] * lamp.strength[0]) for lamp in lamps)


def pairs_of(triangles: np.ndarray) -> int:
    tolerance = tolerances(triangles)
    return len(coincident_pairs(triangles, np.arange(len(triangles)), tolerance, tolerance))


@pytest.mark.parametrize("away", [0.0, 1e3, 1e5])
def test_neighbors_do_not_coincide(away: float) -> None:
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    for plain in (box_room((3, 2, 2), n=6)[0], solid_box((0, 0, 0), (1, 2, 3)), 2.0 * sphere(3)):
        moved = (plain @ turn.T + away).astype(np.float32).astype(np.float64)
        assert pairs_of(moved) == 0


def test_all_pairs_are_found_and_none_twice() -> None:
    rng = np.random.default_rng(2)
    flat = rng.uniform(0, 1, (80, 3, 3)) * rng.choice([0.05, 0.3, 1.0], 80)[:, None, None]
    flat[..., 2] = 0.0
    flat += rng.uniform(0, 1, (80, 1, 3)) * (1, 1, 0)
    tolerance = tolerances(flat)
    found = coincident_pairs(flat, np.arange(80), tolerance, tolerance)
    pairs = {tuple(sorted(pair)) for pair in zip(found.first.tolist(), found.second.tolist(), strict=True)}
    assert len(pairs) == len(found)
    points = rng.uniform(0, 2, (20_000, 2))
    start, end = flat[:, :, :2], np.roll(flat, -1, axis=1)[:, :, :2]
    apart = points[:, None, None] - start
    turn = (end - start)[..., 0] * apart[..., 1] - (end - start)[..., 1] * apart[..., 0]
    inside = (turn > 0).all(axis=2) | (turn < 0).all(axis=2)
    met = inside.T.astype(int) @ inside.astype(int)
    assert {(i, j) for i, j in np.argwhere(met > 0).tolist() if i < j} <= pairs
    size = np.linalg.norm(np.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]), axis=1) / 2
    common = 2.0 * size[found.first] * areas(found.in_first)
    np.testing.assert_allclose(common, 2.0 * size[found.second] * areas(found.in_second), rtol=1e-9)
    counted = met[found.first, found.second] * (4.0 / len(points))
    np.testing.assert_allclose(common, counted, atol=4.0 * np.sqrt(common.max() * 4.0 / len(points)))


@pytest.mark.parametrize("apart", [0.0, 1e-7, 1e-6])
@pytest.mark.parametrize("count", [2, 5])
@pytest.mark.parametrize("away", [0.0, 1e3, 1e5])
def test_copies_glow_once(count: int, apart: float, away: float) -> None:
    offset = np.array([away, -away, away])
    copies = [(UNIT + apart * number * Z + offset).astype(np.float32) for number in range(count)]
    scene = scene_of(*copies, emission=(1.0,) * count)
    one = scene_of(copies[0], emission=(1.0,))
    at = POINT + offset
    found = emitter_groups(scene, Faces(scene), ray_caster(scene))
    single = emitter_groups(one, Faces(one), ray_caster(one))
    assert found[0].unit_irradiance(at, UP) == pytest.approx(single[0].unit_irradiance(at, UP), rel=1e-4)
    assert fronts(scene) @ scene.areas == pytest.approx(1.0)


def test_more_copies_than_are_compared_glow_once() -> None:
    scene = scene_of(*[UNIT] * 300, UNIT[:, [1, 2, 0]], emission=(1.0,) * 301)
    assert len(scene.layers.covers) <= 4 * 301
    assert fronts(scene) @ scene.areas == pytest.approx(1.0)
    hits = ray_caster(scene).intersect(POINT, -Z[None])
    assert fronts(scene)[hits.triangle[0]] == 1.0


@pytest.mark.parametrize("apart", [1.1e-5, 1e-3])
def test_what_is_apart_is_left_alone(apart: float) -> None:
    assert not scene_of(UNIT, UNIT + apart * Z).layers


def test_panels_that_overlap_in_part() -> None:
    """The union glows: what sticks out of one panel, and the other."""
    large, small = rectangle((0, 0, 0), X, Y), rectangle((0.7, 0.2, 0), 0.6 * X, 0.3 * Y, 3)
    for parts in ((large, small), (small, large), (large, small[:, [0, 2, 1]])):
        scene = scene_of(*parts, emission=(1.0, 1.0))
        left = scene.layers.own.share_of(np.arange(2 * len(scene)))
        assert np.repeat(scene.areas, 2) @ left == pytest.approx(2 * (1.0 + 0.3 * 0.3))
        union = scene_of(large, rectangle((1.0, 0.2, 0), 0.3 * X, 0.3 * Y), emission=(1.0, 1.0))
        assert gain(scene) == pytest.approx(gain(union), rel=1e-9)


def test_the_outermost_counts_then_what_glows_then_the_first() -> None:
    def counts(*parts: np.ndarray, emission: tuple[float, ...] = ()) -> list[float]:
        return fronts(scene_of(*parts, emission=emission))[::2].tolist()

    above = UNIT + 1e-6 * Z
    assert counts(UNIT, above, emission=(1.0, 0.0)) == [0.0, 1.0]
    assert counts(UNIT, UNIT, emission=(0.0, 1.0)) == [0.0, 1.0]
    assert counts(UNIT, UNIT, emission=(2.0, 1.0)) == [1.0, 0.0]
    # The backs are seen from the other side.
    scene = scene_of(UNIT, above)
    assert scene.layers.own.share_of(np.array([1, 3, 5, 7])).tolist() == [1.0, 1.0, 0.0, 0.0]


def test_fronts_that_touch_are_covered_and_those_of_neighboring_rooms_are_not() -> None:
    ground = rectangle((-1, -1, 0), 3 * X, 3 * Y)
    standing = scene_of(ground, solid_box((0, 0, 0), (1, 1, 1)))
    # A ninth of the ground, and the box's bottom.
    assert (fronts(standing) * standing.areas)[:2].sum() == pytest.approx(8.0)
    assert fronts(standing)[2:4].tolist() == [0.0, 0.0]
    assert (fronts(standing)[4:] == 1.0).all()
    rooms = scene_of(box_room()[0], box_room()[0] + X)
    assert (fronts(rooms) == 1.0).all()


def test_hits_and_elements_agree_on_what_counts() -> None:
    """A ray that meets a face meets it where it counts, and elements weigh the parts that do."""
    rng = np.random.default_rng(5)
    panels = [rectangle((*rng.uniform(0, 1, 2), 0), *rng.uniform(0.3, 1, (2, 1)) * (X, Y)) for _ in range(6)]
    scene = scene_of(*panels)
    hierarchy = Hierarchy(scene)
    for _ in range(3):
        hierarchy.subdivide(hierarchy.leaves)
    origins = np.concatenate([rng.uniform(0, 2, (40_000, 2)), np.ones((40_000, 1))], axis=1)
    hits = ray_caster(scene).intersect(origins, np.broadcast_to(-Z, origins.shape))
    met = np.bincount(hits.triangle[hits.triangle >= 0], minlength=len(scene)) * (4.0 / len(origins))
    np.testing.assert_allclose(met, fronts(scene) * scene.areas, atol=0.02)
    leaves = hierarchy.leaves
    area = np.bincount(hierarchy.face[leaves], hierarchy.area[leaves] * hierarchy.opacity[leaves])
    np.testing.assert_allclose(area[: len(scene)], fronts(scene) * scene.areas, atol=1e-9)
    np.testing.assert_allclose(hierarchy.reflectance, 0.5 * hierarchy.opacity[:, None] * np.ones(3))


def cut_out(parts: list[np.ndarray], opacity: np.ndarray) -> Scene:
    """Glowing quads that all show the same image of opacity, (h, w)."""
    values = np.concatenate([np.full((*opacity.shape, 6), 0.5), opacity[..., None]], axis=2)
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], dtype=np.float32)
    count = 2 * len(parts)
    images = SurfaceImages(values, np.tile(uv, (len(parts), 1, 1)), np.ones(count, dtype=bool))
    return scene_of(*parts, emission=(1.0,) * len(parts), images=images)


def test_covers_that_are_cut_out_cover_by_their_opacity() -> None:
    half = cut_out([UNIT] * 3, np.full((4, 4), 0.5))
    np.testing.assert_allclose(fronts(half)[::2], [1.0, 0.5, 0.25], rtol=1e-6)
    # Holes in the same places: the same leaf twice is the leaf.
    holes = np.indices((8, 8)).sum(axis=0) % 2.0
    once, twice = cut_out([UNIT], holes), cut_out([UNIT] * 2, holes)
    assert gain(twice) == pytest.approx(gain(once), rel=0.02)
