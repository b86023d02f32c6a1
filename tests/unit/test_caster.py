"""Ray casting: Embree against the brute-force reference, at borders, and far from the origin."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.rays.caster import NO_HIT, BruteForceCaster, RayCaster, surface_offset
from radiosity_addon.rays.embree import EmbreeCaster
from tests.rooms import box_room, rectangle, solid_box, sphere
from tests.vectors import unit_rows

CASTERS = (BruteForceCaster, EmbreeCaster)


def soup(seed: int, count: int = 150) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.uniform(-3, 3, (count, 1, 3)) + rng.normal(size=(count, 3, 3))


@pytest.mark.parametrize("seed", range(3))
def test_first_hits_agree(seed: int) -> None:
    triangles = soup(seed)
    rng = np.random.default_rng(100 + seed)
    origins, directions = rng.uniform(-4, 4, (4000, 3)), unit_rows(rng, 4000)
    expected = BruteForceCaster(triangles).intersect(origins, directions)
    found = EmbreeCaster(triangles).intersect(origins, directions)
    # Only rays that graze an edge within float32's reach may differ.
    same = found.triangle == expected.triangle
    assert same.mean() > 0.999
    hit = same & (expected.triangle != NO_HIT)
    assert 0.3 < hit.mean() < 0.95
    np.testing.assert_allclose(found.distance[hit], expected.distance[hit], rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(found.barycentric[hit], expected.barycentric[hit], atol=2e-3)
    assert (found.front[hit] == expected.front[hit]).mean() > 0.999
    assert 0.3 < found.front[hit].mean() < 0.7
    missed = found.triangle == NO_HIT
    assert np.isinf(found.distance[missed]).all()
    assert not found.barycentric[missed].any()


@pytest.mark.parametrize("kind", CASTERS)
def test_barycentric_weights_give_the_point_on_the_ray(kind: type[RayCaster]) -> None:
    triangles = soup(5)
    rng = np.random.default_rng(6)
    origins, directions = rng.uniform(-4, 4, (2000, 3)), unit_rows(rng, 2000)
    hits = kind(triangles).intersect(origins, directions)
    rows = np.flatnonzero((hits.triangle != NO_HIT) & (hits.distance > 0.05))
    corners = triangles[hits.triangle[rows]]
    second, third = (hits.barycentric[rows, k : k + 1].astype(float) for k in (0, 1))
    points = (1 - second - third) * corners[:, 0] + second * corners[:, 1] + third * corners[:, 2]
    on_ray = origins[rows] + hits.distance[rows, None] * directions[rows]
    # Grazing rays magnify float32's rounding.
    error = np.linalg.norm(points - on_ray, axis=1)
    assert np.median(error) < 2e-6
    assert np.quantile(error, 0.99) < 1e-4


@pytest.mark.parametrize("kind", CASTERS)
def test_sides(kind: type[RayCaster]) -> None:
    caster = kind(rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)))
    hits = caster.intersect(
        np.array([[0.3, 0.6, 2.0], [0.3, 0.6, -2.0], [5, 5, 1]]),
        np.array([[0, 0, -1.0], [0, 0, 1], [0, 0, -1]]),
    )
    assert hits.front[:2].tolist() == [True, False]
    assert hits.triangle.tolist()[2] == NO_HIT
    np.testing.assert_allclose(hits.distance, [2, 2, np.inf], rtol=1e-6)


@pytest.mark.parametrize("kind", CASTERS)
def test_visible_is_a_first_hit_beyond_the_distance(kind: type[RayCaster]) -> None:
    triangles = soup(8)
    rng = np.random.default_rng(9)
    origins, directions = rng.uniform(-4, 4, (3000, 3)), unit_rows(rng, 3000)
    distances = rng.uniform(0.1, 6, 3000)
    first = BruteForceCaster(triangles).intersect(origins, directions).distance
    clear = np.abs(first - distances) > 1e-3
    free = kind(triangles).unoccluded(origins, directions, distances)
    assert free.dtype == bool
    assert (free[clear] == (first > distances)[clear]).mean() > 0.9995
    assert 0.2 < free.mean() < 0.8


@pytest.mark.parametrize("shift", [0.0, 1e4])
def test_segments_that_end_on_a_surface_are_free_and_behind_it_are_not(shift: float) -> None:
    """Between two parallel planes, whatever the slant: the target does not block itself."""
    size = 4.0
    at = np.array([shift, -shift, 0.5 * shift])
    planes = np.concatenate(
        [
            rectangle(at, (size, 0, 0), (0, size, 0)),
            rectangle(at + np.array([0, 0, 1]), (0, size, 0), (size, 0, 0)),
        ]
    )
    caster = EmbreeCaster(planes)
    rng = np.random.default_rng(4)
    start = at + rng.uniform(0, size, (20000, 3)) * [1, 1, 0]
    end = at + np.array([0, 0, 1]) + rng.uniform(0, size, (20000, 3)) * [1, 1, 0]
    up = np.array([0, 0, caster.surface_offset])

    def free(first: np.ndarray, last: np.ndarray) -> np.ndarray:
        along = last - first
        length = np.linalg.norm(along, axis=1)
        return caster.unoccluded(first, along / length[:, None], length)

    inside = (np.abs(end - at - 0.5 * size)[:, :2] < 0.49 * size).all(axis=1)
    assert free(start + up, end - up).all()
    assert free(start + up, end).all()
    assert not free(start + up, end + np.array([0, 0, 1e-3]))[inside].any()
    assert not free(start - up, end)[(np.abs(start - at - 0.5 * size)[:, :2] < 0.49 * size).all(axis=1)].any()


@pytest.mark.parametrize("shift", [0.0, 3e3, 1e6])
def test_far_from_the_origin_nothing_changes(shift: float) -> None:
    triangles = soup(11)
    at = shift * np.array([1.0, -0.7, 0.4])
    rng = np.random.default_rng(12)
    origins, directions = rng.uniform(-4, 4, (3000, 3)), unit_rows(rng, 3000)
    near = EmbreeCaster(triangles).intersect(origins, directions)
    far = EmbreeCaster(triangles + at).intersect(origins + at, directions)
    assert (near.triangle == far.triangle).mean() > 0.999
    assert surface_offset(triangles + at) == pytest.approx(surface_offset(triangles), rel=1e-6)


@pytest.mark.parametrize("shape", ["box", "grid", "sphere"])
def test_a_closed_surface_leaks_nothing(shape: str) -> None:
    """Not even through shared edges and corners, aimed at on purpose."""
    triangles = {"box": box_room()[0], "grid": box_room(n=9)[0], "sphere": sphere(3)}[shape]
    middle = triangles.reshape(-1, 3).mean(axis=0)
    rng = np.random.default_rng(13)
    corners = triangles.reshape(-1, 3)
    pick = triangles[rng.integers(len(triangles), size=40000)]
    along_edge = rng.uniform(size=(40000, 1))
    edges = pick[:, 0] + along_edge * (pick[:, 1] - pick[:, 0])
    targets = np.concatenate([corners, edges, middle + unit_rows(rng, 40000)])
    origins = middle + 0.2 * rng.uniform(-1, 1, targets.shape)
    directions = targets - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    caster = EmbreeCaster(triangles)
    hits = caster.intersect(origins, directions)
    assert (hits.triangle != NO_HIT).all()
    assert hits.front.all()
    assert not caster.unoccluded(origins, directions, np.full(len(origins), np.inf)).any()


@pytest.mark.parametrize("kind", CASTERS)
def test_arguments_are_left_alone_and_rays_counted(kind: type[RayCaster]) -> None:
    """Embree writes into the distances it is given: it must be given a copy."""
    caster = kind(solid_box((-1, -1, -1), (1, 1, 1)))
    rng = np.random.default_rng(14)
    origins, directions = rng.uniform(-3, 3, (500, 3)), unit_rows(rng, 500)
    for distances in (np.full(500, np.inf), np.full(500, 2.0, dtype=np.float32)):
        given = origins.copy(), directions.copy(), distances.copy()
        caster.unoccluded(origins, directions, distances)
        caster.intersect(origins, directions)
        for now, before in zip((origins, directions, distances), given, strict=True):
            np.testing.assert_array_equal(now, before)
    assert caster.rays == 4 * 500


def test_threads_and_chunks_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    triangles = soup(15)
    rng = np.random.default_rng(16)
    origins, directions = rng.uniform(-4, 4, (5000, 3)), unit_rows(rng, 5000)
    distances = rng.uniform(0.1, 6, 5000)
    whole = EmbreeCaster(triangles, threads=1)
    free, hits = whole.unoccluded(origins, directions, distances), whole.intersect(origins, directions)
    monkeypatch.setattr("radiosity_addon.rays.embree.CHUNK", 333)
    pieces = EmbreeCaster(triangles, threads=3)
    assert pieces.unoccluded(origins, directions, distances).tobytes() == free.tobytes()
    again = pieces.intersect(origins, directions)
    for name in ("triangle", "barycentric", "front", "distance"):
        assert getattr(again, name).tobytes() == getattr(hits, name).tobytes()


def test_an_empty_scene_blocks_nothing() -> None:
    caster = EmbreeCaster(np.zeros((0, 3, 3)))
    rays = np.zeros((3, 3)), np.tile([0.0, 0, 1], (3, 1))
    assert caster.unoccluded(*rays, np.full(3, np.inf)).all()
    hits = caster.intersect(*rays)
    assert (hits.triangle == NO_HIT).all()
    assert np.isinf(hits.distance).all()
    assert caster.surface_offset > 0


def test_no_rays_no_answers() -> None:
    none = np.zeros((0, 3))
    caster = EmbreeCaster(soup(1))
    assert caster.unoccluded(none, none, np.zeros(0)).shape == (0,)
    assert caster.intersect(none, none).barycentric.shape == (0, 2)
