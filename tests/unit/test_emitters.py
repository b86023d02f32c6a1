"""Emissive faces as lamps: exact factors, and samples in proportion to them."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver import Scene, emitters
from radiosity_addon.solver.embree import EmbreeCaster
from radiosity_addon.solver.emitters import EmitterGroup
from radiosity_addon.solver.form_factor import point_to_polygon
from radiosity_addon.solver.hierarchy import Faces
from radiosity_addon.solver.sampling import stratified_square
from tests.rooms import grey, rectangle

OFFSET = 1e-6


def normals_of(triangles: np.ndarray) -> np.ndarray:
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return cross / np.linalg.norm(cross, axis=1, keepdims=True)


def group_of(triangles: np.ndarray, offset: float = OFFSET) -> EmitterGroup:
    return EmitterGroup(triangles, normals_of(triangles), np.ones(3), offset)


def setting(count: int = 40, faces: int = 5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random points and normals below a ceiling of random triangles."""
    rng = np.random.default_rng(2)
    triangles = rng.uniform(-1, 1, (faces, 1, 3)) + rng.normal(size=(faces, 3, 3)) * 0.6 + np.array([0, 0, 3])
    down = normals_of(triangles)[:, 2] < 0
    triangles[~down] = triangles[~down][:, [0, 2, 1]]
    normals = rng.normal(size=(count, 3)) + np.array([0, 0, 1])
    return triangles, rng.uniform(-1, 1, (count, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)


def factors(triangles: np.ndarray, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return (n, m) factors, face by face."""
    columns = [
        point_to_polygon(points, normals, np.broadcast_to(face, (len(points), 3, 3))) for face in triangles
    ]
    return np.stack(columns, axis=1)


def test_irradiance_is_the_sum_of_the_factors(monkeypatch: pytest.MonkeyPatch) -> None:
    triangles, points, normals = setting()
    expected = factors(triangles, points, normals).sum(axis=1)
    assert (expected > 0).mean() > 0.8
    np.testing.assert_array_equal(group_of(triangles).unit_irradiance(points, normals), expected)
    monkeypatch.setattr(emitters, "CHUNK_PAIRS", 13)
    np.testing.assert_array_equal(group_of(triangles).unit_irradiance(points, normals), expected)


def test_rays_go_to_faces_in_proportion_to_their_factors() -> None:
    triangles, points, normals = setting()
    count = 2048
    u = stratified_square(np.arange(len(points)), count)
    directions, distances, _ = group_of(triangles).shadow_rays(points, normals, u)
    targets = points[:, None] + directions * distances[..., None]
    hits = EmbreeCaster(triangles)
    start = (targets - 1e-3 * directions).reshape(-1, 3)
    face = hits.first_hits(start, directions.reshape(-1, 3)).triangle.reshape(-1, count)
    share = np.stack([(face == number).mean(axis=1) for number in range(len(triangles))], axis=1)
    expected = factors(triangles, points, normals)
    lit = expected.sum(axis=1) > 1e-3
    expected = expected[lit] / expected[lit].sum(axis=1, keepdims=True)
    np.testing.assert_allclose(share[lit], expected, atol=0.01)


def test_weights_average_to_one_as_each_ray_stands_for_the_same_irradiance() -> None:
    """Σ over rays of weight × factor / rays is the irradiance, so the mean weight is 1."""
    triangles, points, normals = setting()
    group = group_of(triangles)
    # Below the horizon the samples are spread over the whole face, not its part above it.
    above = ((triangles[None] - points[:, None, None]) * normals[:, None, None]).sum(axis=-1) > 0
    lit = above.all(axis=(1, 2)) & (factors(triangles, points, normals) > 0).all(axis=1)
    assert lit.sum() >= 3
    u = stratified_square(np.arange(len(points)), 4096)
    _, _, weights = group.shadow_rays(points, normals, u)
    np.testing.assert_allclose(weights[lit].mean(axis=1), 1.0, atol=0.01)
    partly = group.unit_irradiance(points, normals) > 1e-3
    np.testing.assert_allclose(weights[partly].mean(axis=1), 1.0, atol=0.03)


def test_rays_end_just_before_the_surface_and_meet_nothing_on_the_way() -> None:
    triangles = rectangle((-1, -1, 2), (0, 2, 0), (2, 0, 0), 4)
    caster = EmbreeCaster(triangles)
    rng = np.random.default_rng(3)
    points = np.concatenate([rng.uniform(-3, 3, (200, 2)), rng.uniform(0, 1.999, (200, 1))], axis=1)
    normals = np.tile([0, 0, 1.0], (200, 1))
    group = group_of(triangles, caster.surface_offset)
    directions, distances, weights = group.shadow_rays(points, normals, stratified_square(np.arange(200), 64))
    np.testing.assert_allclose(np.linalg.norm(directions, axis=2), 1.0, rtol=1e-12)
    ends = points[:, None] + directions * distances[..., None]
    np.testing.assert_allclose(ends[..., 2], 2 - caster.surface_offset, atol=1e-12)
    assert (weights > 0).all()
    start = np.repeat(points, 64, axis=0)
    assert caster.visible(start, directions.reshape(-1, 3), distances.ravel()).all()


def test_points_that_see_no_face_get_no_weight() -> None:
    triangles = rectangle((-1, -1, 2), (0, 2, 0), (2, 0, 0))
    points = np.array([[0, 0, 0], [0, 0, 3.0], [0, 0, 0]])
    normals = np.array([[0, 0, -1.0], [0, 0, -1], [0, 0, 1]])
    group = group_of(triangles)
    assert (group.unit_irradiance(points, normals) > 0).tolist() == [False, False, True]
    _, _, weights = group.shadow_rays(points, normals, stratified_square(np.arange(3), 16))
    assert not weights[:2].any()
    assert np.isfinite(weights).all()


def test_faces_are_grouped_by_colour_and_each_shines_from_its_own_sides() -> None:
    triangles = np.concatenate([rectangle((i, 0, 0), (1, 0, 0), (0, 1, 0)) for i in range(3)])
    emission = np.repeat([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [2.0, 2.0, 2.0]], 2, axis=0)
    emission[1] = emission[4]  # one triangle of the first square shines like the last
    scene = Scene(triangles, grey(6, 0.5), emission, two_sided=np.array([False] * 4 + [True] * 2))
    groups = EmitterGroup.of_faces(Faces(scene), EmbreeCaster(triangles))
    assert sorted(group.strength.tolist() for group in groups) == [[1, 0, 0], [2, 2, 2]]
    below = np.array([[2.5, 0.5, -1.0], [0.7, 0.2, -1.0]])
    up = np.tile([0, 0, 1.0], (2, 1))
    white = next(group for group in groups if group.strength[2] == 2)
    backs = factors(triangles[4:, [0, 2, 1]], below, up).sum(axis=1)
    np.testing.assert_allclose(white.unit_irradiance(below, up), backs, rtol=1e-12)
    red = next(group for group in groups if group.strength[2] == 0)
    assert not red.unit_irradiance(below, up).any()
    dark = Scene(triangles, grey(6, 0.5), grey(6, 0.0))
    assert EmitterGroup.of_faces(Faces(dark), EmbreeCaster(triangles)) == []
