"""Emissive faces as lamps: exact factors, and samples in proportion to them."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.form_factors.formulas import point_to_polygon
from radiosity_addon.numerics.sampling import stratified_square
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.scene.faces import Faces
from radiosity_addon.solver import SolverSettings, solve
from radiosity_addon.solver.emitters import emitter_groups, emitters
from radiosity_addon.solver.emitters.emitters import EmitterGroup
from radiosity_addon.solver.gather.footprints import Footprints, SpreadPoints
from radiosity_addon.solver.gather.soft_shadows import ShadowShare
from tests.rooms import gray_scene, rectangle, sphere
from tests.vectors import normals_of

OFFSET = 1e-6


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
    face = hits.intersect(start, directions.reshape(-1, 3)).triangle.reshape(-1, count)
    share = np.stack([(face == number).mean(axis=1) for number in range(len(triangles))], axis=1)
    expected = factors(triangles, points, normals)
    lit = expected.sum(axis=1) > 1e-3
    expected = expected[lit] / expected[lit].sum(axis=1, keepdims=True)
    np.testing.assert_allclose(share[lit], expected, atol=0.01)


def test_weights_follow_the_kernel_within_a_face_and_average_to_one_over_it() -> None:
    """Σ over rays of weight × factor / rays is each face's irradiance, however its points fall."""
    triangles, points, normals = setting()
    count = 64
    u = stratified_square(np.arange(len(points)), count)
    directions, distances, weights = group_of(triangles).shadow_rays(points, normals, u)
    targets = points[:, None] + directions * distances[..., None]
    plane = ((targets[:, :, None] - triangles[:, 0]) * normals_of(triangles)).sum(axis=-1)
    face = np.abs(plane - OFFSET).argmin(axis=2)
    cos_r = (directions * normals[:, None]).sum(axis=2)
    cos_s = -(directions * normals_of(triangles)[face]).sum(axis=2)
    kernel = np.maximum(cos_r, 0) * np.maximum(cos_s, 0) / distances**2
    some = 0
    for row in range(len(points)):
        for number in range(len(triangles)):
            mine = face[row] == number
            if not kernel[row, mine].any():
                continue
            expected = kernel[row, mine] / kernel[row, mine].mean()
            np.testing.assert_allclose(weights[row, mine], expected, rtol=1e-6, atol=1e-9)
            some += 1
    assert some > 60


def test_a_hidden_face_far_off_does_not_darken_what_lies_close_before_a_large_one() -> None:
    """No ray finds the spot most light comes from: the far face has the rays its factor gives it."""
    near, far = rectangle((-1, -1, 1e-3), (0, 2, 0), (2, 0, 0)), rectangle((2, -1, 1), (0, 0, 1), (0, 2, 0))
    triangles = np.concatenate([near, far])
    screen = rectangle((1.8, -2, 2e-3), (0, 4, 0), (0, 0, 4))
    caster = EmbreeCaster(np.concatenate([triangles, screen]))
    group = group_of(triangles, 2 * caster.surface_offset)
    count = 200
    flat = np.random.default_rng(5).uniform(-0.5, 0.5, (count, 2))
    points = np.concatenate([flat, np.zeros((count, 1))], axis=1)
    at = Footprints(points, np.tile([0, 0, 1.0], (count, 1)), np.arange(count))
    share = ShadowShare(caster, group, SpreadPoints(at, 0), 0).at_points(np.ones(count, dtype=bool), 64)
    factor = factors(triangles, points, at.normals)
    truth = factor[:, :2].sum(axis=1) / factor.sum(axis=1)
    assert (truth < 0.999).mean() > 0.5
    np.testing.assert_allclose(share, truth, atol=0.01)


def test_around_a_bulb_no_ray_is_blocked_by_the_bulb() -> None:
    """Its inside shines as well, and faces each point from across: half of all rays would be blocked."""
    bulb = sphere(2)[:, [0, 2, 1]] * 0.1
    scene = gray_scene(bulb, 0.5, np.ones((len(bulb), 3)), two_sided=np.ones(len(bulb), dtype=bool))
    caster = EmbreeCaster(bulb)
    outer, inner = emitter_groups(scene, Faces(scene), caster)
    rng = np.random.default_rng(2)
    points = rng.normal(size=(300, 3))
    points *= rng.uniform(0.15, 3.0, (300, 1)) / np.linalg.norm(points, axis=1, keepdims=True)
    at = Footprints(points, -points / np.linalg.norm(points, axis=1, keepdims=True), np.arange(300))
    for group, expected in ((outer, 1.0), (inner, 0.0)):
        gain = group.unit_irradiance(at.points, at.normals)
        assert (gain > 1e-4).all()
        share = ShadowShare(caster, group, SpreadPoints(at, 0), 0).at_points(gain, 16)
        np.testing.assert_allclose(share, expected, atol=1e-12)


def test_a_footprint_that_a_panel_cuts_gets_all_light_of_its_sides() -> None:
    """A post stands in a shining panel: above it one sees its upper side alone, below it the lower."""
    panel = rectangle((-1, -1, 0), (0, 2, 0), (2, 0, 0))
    scene = gray_scene(panel, 0.5, np.ones((2, 3)), two_sided=np.ones(2, dtype=bool))
    caster = EmbreeCaster(panel)
    points, normals = np.array([[0.0, 0.0, -0.002]]), np.array([[1.0, 0.0, 0.0]])

    def sampler(rows: np.ndarray, u: np.ndarray) -> np.ndarray:
        return points[rows, None] + 0.02 * (u[..., 1:] - 0.5) * np.array([0.0, 0.0, 1.0])

    at = Footprints(points, normals, np.arange(1), sampler)
    spread = SpreadPoints(at, 1)
    groups = emitter_groups(scene, Faces(scene), caster)
    assert len(groups) == 2
    gains = [spread.gain(group, 0.05) for group in groups]
    shares = [
        ShadowShare(caster, group, spread, 0).at_points(gain, 16)
        for group, gain in zip(groups, gains, strict=True)
    ]
    np.testing.assert_allclose(shares, 1.0, atol=1e-12)
    # Half of a wall's hemisphere is above it.
    assert sum(gains)[0] == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("many", [1, 256])
def test_rays_from_points_carry_what_faces_send_there(many: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Their mean weight is the irradiance."""
    monkeypatch.setattr(emitters, "MANY", many)
    panel = rectangle((-1, -1, 0.01), (0, 2, 0), (2, 0, 0), 4)
    group, rays = group_of(panel, 1e-6), 4096
    points = np.random.default_rng(8).uniform((-0.5, -0.5, -0.02), (0.5, 0.5, 0.005), (20, 3))
    normals = np.tile([0.8, 0.0, 0.6], (20, 1))
    start, up = np.repeat(points, rays, axis=0), np.repeat(normals, rays, axis=0)
    unit = stratified_square(np.arange(20), rays)
    directions, distances, weights = group.rays_from(start, up, unit.reshape(-1, 2))
    mean, truth = weights.reshape(20, -1).mean(axis=1), factors(panel, points, normals).sum(axis=1)
    np.testing.assert_allclose(mean, truth, rtol=0.02)
    assert mean.mean() == pytest.approx(truth.mean(), rel=2e-3)
    ends = (start + directions * distances[:, None])[weights > 0.0]
    np.testing.assert_allclose(ends[:, 2], 0.01 - 1e-6, atol=1e-9)


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
    assert caster.unoccluded(start, directions.reshape(-1, 3), distances.ravel()).all()


def test_points_that_see_no_face_get_no_weight() -> None:
    triangles = rectangle((-1, -1, 2), (0, 2, 0), (2, 0, 0))
    points = np.array([[0, 0, 0], [0, 0, 3.0], [0, 0, 0]])
    normals = np.array([[0, 0, -1.0], [0, 0, -1], [0, 0, 1]])
    group = group_of(triangles)
    assert (group.unit_irradiance(points, normals) > 0).tolist() == [False, False, True]
    _, _, weights = group.shadow_rays(points, normals, stratified_square(np.arange(3), 16))
    assert not weights[:2].any()
    assert np.isfinite(weights).all()


def test_faces_are_grouped_by_color_and_each_shines_from_its_own_sides() -> None:
    triangles = np.concatenate([rectangle((i, 0, 0), (1, 0, 0), (0, 1, 0)) for i in range(3)])
    emission = np.repeat([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [2.0, 2.0, 2.0]], 2, axis=0)
    emission[1] = emission[4]  # one triangle of the first square shines like the last
    scene = gray_scene(triangles, 0.5, emission, two_sided=np.array([False] * 4 + [True] * 2))
    groups = EmitterGroup.of_faces(Faces(scene), EmbreeCaster(triangles))
    assert sorted(group.strength.tolist() for group in groups) == [[1, 0, 0], [2, 2, 2]]
    below = np.array([[2.5, 0.5, -1.0], [0.7, 0.2, -1.0]])
    up = np.tile([0, 0, 1.0], (2, 1))
    white = next(group for group in groups if group.strength[2] == 2)
    backs = factors(triangles[4:, [0, 2, 1]], below, up).sum(axis=1)
    np.testing.assert_allclose(white.unit_irradiance(below, up), backs, rtol=1e-12)
    red = next(group for group in groups if group.strength[2] == 0)
    assert not red.unit_irradiance(below, up).any()
    dark = gray_scene(triangles)
    assert EmitterGroup.of_faces(Faces(dark), EmbreeCaster(triangles)) == []


def test_lifted_rays_do_not_end_on_a_face_that_lies_parallel() -> None:
    """A hair below a shining plane: half of all rays run nearly along it, and none may be stopped by it."""
    triangles = rectangle((-1, -1, 1e-3), (0, 2, 0), (2, 0, 0))
    caster = EmbreeCaster(triangles)
    scene = gray_scene(triangles, 0.5, 1.0)
    (group,) = EmitterGroup.of_faces(Faces(scene), caster)
    points = np.concatenate([np.random.default_rng(5).uniform(-0.5, 0.5, (50, 2)), np.zeros((50, 1))], axis=1)
    at = Footprints(points, np.tile([0, 0, 1.0], (50, 1)), np.arange(50))
    share = ShadowShare(caster, group, SpreadPoints(at, 0), 0).at_points(np.ones(50, dtype=bool), 16)
    np.testing.assert_allclose(share, 1.0, rtol=1e-12)


def test_a_face_does_not_light_itself_from_behind() -> None:
    """Both sides of a floor glow, as a wall does: it gets the wall's light, none from its own back."""
    floor, wall = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), rectangle((0, 0, 0), (0, 1, 0), (0, 0, 1))
    points = np.array([[0.5, 0.5, 0.0], [0.1, 0.5, 0.0], [0.9, 0.2, 0.0]])
    scene = gray_scene(np.concatenate([floor, wall]), 0.4, 0.3, two_sided=True)
    light = solve(scene, SolverSettings(error=1e-2)).local_pass.direct.at(
        Footprints(points, np.tile([0, 0, 1.0], (3, 1)), np.arange(3))
    )
    alone = factors(wall, points, np.tile([0, 0, 1.0], (3, 1))).sum(axis=1)
    np.testing.assert_allclose(light, 0.3 * np.repeat(alone[:, None], 3, axis=1), rtol=1e-9)


def test_a_footprint_that_is_rounded_off_its_plane_does_not_see_its_own_back() -> None:
    """A slope whose both sides glow, far from the origin and beside a wall: points of single precision."""
    here = np.array([30.0, -20.0, 10.0])
    slope = rectangle(here, (1, 0.3, 0.2), (-0.3, 1, 0.7))
    wall = rectangle(here, (-0.3, 1, 0.7), (0, 0, 1))
    scene = gray_scene(np.concatenate([slope, wall]), 0.4, 0.3, two_sided=True)
    faces = Faces(scene)
    (group,) = EmitterGroup.of_faces(faces, EmbreeCaster(scene.triangles))
    places = np.random.default_rng(7).uniform(0.2, 0.8, (300, 2))
    places[:, 0] *= 0.1  # near the wall, which fills much of the view
    across = slope[0, 1] - slope[0, 0], slope[1, 2] - slope[1, 0]
    center = here + places[:, :1] * across[0] + places[:, 1:] * across[1]
    spread = SpreadPoints(
        Footprints(
            center,
            np.repeat(normals_of(slope)[:1], len(center), axis=0),
            np.arange(len(center)),
            lambda rows, u: center[rows, None] + 0.01 * (u[..., :1] * across[0] + u[..., 1:] * across[1]),
        ),
        1,
    )
    points = spread.points(slice(None)).reshape(-1, 3)
    above = (points - here) @ normals_of(slope)[0]
    assert np.abs(above).max() < 1e-8
    assert (above < -1e-10).mean() > 0.2
    expected = factors(wall, points, np.repeat(spread.at.normals, spread.count, axis=0)).sum(axis=1)
    expected += factors(wall[:, ::-1], points, np.repeat(spread.at.normals, spread.count, axis=0)).sum(axis=1)
    gain = spread.gain(group, 0.05)
    np.testing.assert_allclose(gain, expected.reshape(-1, spread.count).mean(axis=1), atol=1e-4)
    assert gain.min() > 0.1
