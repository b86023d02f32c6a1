"""Lamps of very many triangles: merged where they are flat, asked in groups where they are far."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics import double_area_vectors
from radiosity_addon.numerics.sampling import stratified_square
from radiosity_addon.solver.emitters import emitters
from radiosity_addon.solver.emitters.direction_table import DirectionTable
from radiosity_addon.solver.emitters.emitter_tree import EmitterTree
from radiosity_addon.solver.emitters.emitters import EmitterGroup
from radiosity_addon.solver.emitters.merged_faces import merge_flat
from tests.rooms import rectangle, sphere
from tests.vectors import areas_of, normals_of

CENTER = np.array([2.5, 2.0, 2.0])


def panel(n: int = 20) -> np.ndarray:
    return rectangle((1.6, 1.3, 3.0), (0.0, 1.4, 0.3), (1.7, 0.1, 0.0), n)


def bulb() -> np.ndarray:
    return sphere(4)[:, [0, 2, 1]] * 0.3 + CENTER


def ragged() -> np.ndarray:
    triangles = panel()
    middle = triangles.mean(axis=1)
    return triangles[np.abs(middle[:, 0] - 2.45) + 0.1 * np.sin(37 * middle[:, 1]) < 0.7]


def places(count: int, apart: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    points = rng.uniform((0, 0, 0), (5, 4, 2.9), (3 * count, 3))
    points = points[np.linalg.norm(points - CENTER, axis=1) > apart][:count]
    normals = rng.normal(size=points.shape)
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def group(triangles: np.ndarray, many: int, monkeypatch: pytest.MonkeyPatch) -> EmitterGroup:
    monkeypatch.setattr(emitters, "MANY", many)
    monkeypatch.setattr(emitters, "FEW", many)
    return EmitterGroup(triangles, normals_of(triangles), np.ones(3), 1e-6)


def test_a_tessellated_panel_is_two_triangles_that_send_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    every = panel()
    corners, first = merge_flat(np.random.default_rng(1).permutation(every))
    assert len(corners) == len(first) == 2
    np.testing.assert_allclose(normals_of(corners), np.broadcast_to(normals_of(every)[0], (2, 3)), atol=1e-12)
    points, normals = places(200)
    one, other = (group(triangles, 10**9, monkeypatch) for triangles in (every, corners))
    expected = one.unit_irradiance(points, normals)
    assert expected.max() > 0.1
    np.testing.assert_allclose(other.unit_irradiance(points, normals), expected, atol=1e-12)


def test_an_l_shape_keeps_its_notch() -> None:
    shape = np.concatenate(
        [rectangle((0, 0, 0), (2, 0, 0), (0, 1, 0), 4), rectangle((0, 1, 0), (2, 0, 0), (0, 1, 0), 4)]
    )
    middle = shape.mean(axis=1)
    shape = shape[(middle[:, 0] < 1) | (middle[:, 1] < 1)]
    corners, _ = merge_flat(shape)
    assert len(corners) == 4
    assert areas_of(corners).sum() == pytest.approx(3.0)
    assert not ((corners.mean(axis=1)[:, :2] > 1).all(axis=1)).any()


@pytest.mark.parametrize("what", ["frame", "bulb", "sheets", "two"])
def test_what_is_no_plain_outline_stays(what: str) -> None:
    """A frame around a hole, a curved surface, sheets that lie on each other, and single pairs."""
    grid = rectangle((0, 0, 0), (3, 0, 0), (0, 3, 0), 3)
    hole = (np.abs(grid.mean(axis=1)[:, :2] - 1.5) < 0.5).all(axis=1)
    shape = {
        "frame": grid[~hole],
        "bulb": bulb(),
        "sheets": np.concatenate([grid, grid]),
        "two": rectangle((0, 0, 0), (3, 0, 0), (0, 3, 0)),
    }[what]
    corners, first = merge_flat(shape)
    np.testing.assert_array_equal(corners, shape)
    np.testing.assert_array_equal(first, np.arange(len(shape)))


def test_sides_and_separate_panels_are_merged_apart() -> None:
    low, high = panel(6), panel(6) + np.array([0.0, 0.0, 1.0])
    corners, first = merge_flat(np.concatenate([low, low[:, [0, 2, 1]], high]))
    assert len(corners) == 6
    up = normals_of(corners) @ normals_of(low)[0]
    np.testing.assert_allclose(np.sort(up), [-1, -1, 1, 1, 1, 1])
    np.testing.assert_array_equal(up > 0, (first < len(low)) | (first >= 2 * len(low)))


@pytest.mark.parametrize(("shape", "rms"), [("ragged", 0.002), ("bulb", 0.01)])
def test_groups_send_what_their_faces_send(shape: str, rms: float, monkeypatch: pytest.MonkeyPatch) -> None:
    triangles, apart = (ragged(), 0.0) if shape == "ragged" else (bulb(), 0.4)
    points, normals = places(1000, apart)
    expected = group(triangles, 10**9, monkeypatch).unit_irradiance(points, normals)
    found = group(triangles, 64, monkeypatch).unit_irradiance(points, normals)
    assert np.sqrt(((found - expected) ** 2).mean()) < rms * expected.mean()
    tree = EmitterTree(triangles, normals_of(triangles), np.ones(len(triangles)))
    assert len(tree.ask(points, normals).row) < 0.1 * len(points) * len(triangles)


@pytest.mark.parametrize("many", [64, 10**9])
def test_a_bulb_that_glows_on_both_sides_does_not_light_itself(
    many: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Points are rounded a hair behind their own faces, where those faces' backs are in front of them."""
    outside = bulb()
    lamp = group(np.concatenate([outside, outside[:, [0, 2, 1]]]), many, monkeypatch)
    normals = normals_of(outside)
    for behind in (-1e-9, 0.0, 1e-9):
        own = lamp.unit_irradiance(outside.mean(axis=1) - behind * normals, normals)
        assert own.max() < 1e-3


def test_what_a_point_gets_does_not_depend_on_who_asks_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    points, normals = places(500, 0.4)
    lamp = group(bulb(), 64, monkeypatch)
    together = lamp.unit_irradiance(points, normals)
    monkeypatch.setattr(emitters, "CHUNK_POINTS", 7)
    np.testing.assert_array_equal(lamp.unit_irradiance(points, normals), together)
    np.testing.assert_array_equal(lamp.unit_irradiance(points[::3], normals[::3]), together[::3])


@pytest.mark.parametrize("shape", ["panel", "bulb"])
def test_small_faces_send_like_disks(shape: str, monkeypatch: pytest.MonkeyPatch) -> None:
    triangles, apart = (panel(8), 0.0) if shape == "panel" else (sphere(2)[:, [0, 2, 1]] * 0.1 + CENTER, 0.1)
    points, normals = places(1000, apart)
    exact = group(triangles, 10**9, monkeypatch).factors(points, normals)
    monkeypatch.setattr(emitters, "FEW", 8)
    lamp = EmitterGroup(triangles, normals_of(triangles), np.ones(3), 1e-6)
    found = lamp.factors(points, normals)
    assert ((found > 0) == (exact > 0)).all()
    total = exact.sum(axis=1)
    np.testing.assert_allclose(found.sum(axis=1), total, rtol=0.01, atol=1e-9)
    np.testing.assert_allclose(found.sum(), exact.sum(), rtol=0.001)
    np.testing.assert_array_equal(lamp.factors(points[::3], normals[::3]), found[::3])


def test_levels_weigh_the_faces(monkeypatch: pytest.MonkeyPatch) -> None:
    triangles = ragged()
    level = np.random.default_rng(3).uniform(size=len(triangles))
    points, normals = places(300)
    gains = []
    for many in (10**9, 64):
        monkeypatch.setattr(emitters, "MANY", many)
        lamp = EmitterGroup(triangles, normals_of(triangles), np.ones(3), 1e-6, level)
        gains.append(lamp.unit_irradiance(points, normals))
    assert np.sqrt(((gains[1] - gains[0]) ** 2).mean()) < 0.005 * gains[0].mean()


@pytest.mark.parametrize("shape", ["ragged", "bulb"])
def test_rays_into_groups_tell_the_share_of_light_that_passes(
    shape: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Hide what lies beyond a plane: the weighted share of the rays is that of the faces' factors."""
    triangles = ragged() if shape == "ragged" else bulb()
    points, normals = places(300, 0.4)
    exact = group(triangles, 10**9, monkeypatch)
    factors = exact.factors(points, normals)
    lit = factors.sum(axis=1) > 0.02
    points, normals, factors = points[lit], normals[lit], factors[lit]
    seen = triangles.mean(axis=1)[:, 0] > 2.5
    expected = factors[:, seen].sum(axis=1) / factors.sum(axis=1)
    u = stratified_square(np.arange(len(points)), 256, 5)
    lamp = group(triangles, 64, monkeypatch)
    directions, distances, weights = lamp.shadow_rays(points, normals, u)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=2), 1.0)
    ends = points[:, None] + directions * distances[..., None]
    share = (weights * (ends[..., 0] > 2.5)).sum(axis=1) / weights.sum(axis=1)
    assert 0.2 < expected.mean() < 0.8
    assert np.abs(share - expected).mean() < 0.02
    assert abs((share - expected).mean()) < 0.006


def test_points_behind_every_face_get_no_weight(monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.array([[2.4, 2.0, 4.0], [2.4, 2.0, 0.5]])
    normals = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    down = panel()[:, [0, 2, 1]] if normals_of(panel())[0, 2] > 0 else panel()
    lamp = group(down, 64, monkeypatch)
    gain = lamp.unit_irradiance(points, normals)
    assert gain[0] == 0.0 < gain[1]
    _, _, weights = lamp.shadow_rays(points, normals, stratified_square(np.arange(2), 16, 1))
    assert not weights[0].any()
    assert weights[1].mean() == pytest.approx(1.0, abs=1e-9)


def bulbs(count: int, radius: float = 0.04) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles of bulbs in a room, and (count, 3) their centers."""
    random = np.random.default_rng(3)
    centers = random.uniform((0.0, 0.0, 0.7), (8.0, 6.0, 2.2), size=(count, 3))
    one = sphere(2)[:, [0, 2, 1]] * radius
    return (one + centers[:, None, None]).reshape(-1, 3, 3), centers


def around(centers: np.ndarray, count: int, apart: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points in the room of bulbs, no nearer to any than `apart`, and directions."""
    random = np.random.default_rng(5)
    points = random.uniform((0.0, 0.0, 0.0), (8.0, 6.0, 3.0), size=(count, 3))
    normals = random.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    kept = np.linalg.norm(points[:, None] - centers, axis=2).min(axis=1) > apart
    return points[kept], normals[kept]


def test_far_bulbs_are_one_lamp_each(monkeypatch: pytest.MonkeyPatch) -> None:
    triangles, centers = bulbs(8)
    points, normals = around(centers, 1000, 10.5 * 0.04)
    found = group(triangles, 64, monkeypatch).unit_irradiance(points, normals)
    expected = group(triangles, 10**9, monkeypatch).unit_irradiance(points, normals)
    assert np.sqrt(((found - expected) ** 2).mean()) < 0.003 * expected.mean()
    assert found.sum() == pytest.approx(expected.sum(), rel=0.001)
    tree = EmitterTree(triangles, normals_of(triangles), np.ones(len(triangles)))
    assert len(tree.ask(points, normals).row) < 8 * len(points)


def test_rays_to_far_bulbs_are_shared_by_what_they_send(monkeypatch: pytest.MonkeyPatch) -> None:
    triangles, centers = bulbs(8)
    points, normals = around(centers, 200, 10.5 * 0.04)
    factors = group(triangles, 10**9, monkeypatch).factors(points, normals)
    lit = factors.sum(axis=1) > 0.1 * factors.sum(axis=1).mean()
    points, normals, factors = points[lit], normals[lit], factors[lit]
    hidden = triangles.mean(axis=1)[:, 0] > 4.0
    expected = factors[:, hidden].sum(axis=1) / factors.sum(axis=1)
    u = stratified_square(np.arange(len(points)), 256, 5)
    directions, distances, weights = group(triangles, 64, monkeypatch).shadow_rays(points, normals, u)
    ends = points[:, None] + directions * distances[..., None]
    share = (weights * (ends[..., 0] > 4.0)).sum(axis=1) / weights.sum(axis=1)
    assert np.abs(share - expected).mean() < 0.01
    # On the near side of a bulb, where light leaves it: few rays are wasted on its back.
    nearest = np.linalg.norm(ends[:, :, None] - centers, axis=3).argmin(axis=2)
    outward = np.einsum("nkc,nkc->nk", ends - centers[nearest], directions)
    assert (outward < 0).mean() > 0.9


def test_a_sphere_far_away_sends_by_its_solid_angle() -> None:
    """Of an exact sphere F = (r / d)² cos θ; this one's triangles have as much area as shows of them."""
    triangles = sphere(4)[:, [0, 2, 1]] * 0.1
    twice = np.linalg.norm(double_area_vectors(triangles), axis=1)
    table = DirectionTable(
        triangles.mean(axis=1),
        normals_of(triangles),
        0.5 * twice,
        np.zeros((1, 3)),
        np.array([0]),
        np.array([len(triangles)]),
    )
    points, normals = around(np.zeros((1, 3)), 500, 1.0)
    distance = np.linalg.norm(points, axis=1)
    rise = -np.einsum("nk,nk->n", points, normals)
    up = rise > 0.1
    found = table.factors(np.zeros(up.sum(), dtype=int), points[up], normals[up], rise[up], distance[up])
    shown = twice.sum() / 8.0
    np.testing.assert_allclose(found, shown * rise[up] / (np.pi * distance[up] ** 3), rtol=0.005)


def test_groups_too_small_to_count_get_no_light_and_no_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers that are rounded up to the end of all light choose them now and then."""
    specks = 1e-11 * panel(16) + CENTER + (0.5, 0.0, 0.0)
    lamp = group(np.concatenate([bulb(), specks]), 64, monkeypatch)
    points, facing = places(2000, 0.6)
    unit = np.tile((np.nextafter(1.0, 0.0), 0.5), (len(points), 1))
    with np.errstate(invalid="raise", divide="raise"):
        _, distances, weights = lamp.rays_from(points, facing, unit)
    assert np.isfinite(distances).all()
    assert (weights >= 0.0).all()
