"""Rays through triangles that are only partly there."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.rays.caster import NO_HIT, BruteForceCaster, Hits
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.scene.opacity import ENDED, FAINT, CutOutCaster, ray_caster
from radiosity_addon.scene.textures import SurfaceImages
from tests.rooms import gray_scene, rectangle
from tests.textured_rooms import image
from tests.unit.texel_scenes import QUAD_UV

LAYERS = 5


def stack(opacities: np.ndarray) -> tuple[np.ndarray, SurfaceImages]:
    """Unit squares at heights 1, 2, … of the opacities (k, h, w), over a whole one at 0."""
    count = len(opacities)
    triangles = np.concatenate([rectangle((0, 0, z), (1, 0, 0), (0, 1, 0)) for z in range(count + 1)])
    size = opacities.shape[1]
    values = image(size, 0.5, 0.0, np.concatenate(list(opacities), axis=1), wide=size * count)
    inset = 0.5 / size
    # Half a texel inside, so that look-ups keep to the layer's own part.
    inner = inset + QUAD_UV * (1 - 2 * inset)
    uv = [np.zeros_like(QUAD_UV), *((inner + np.array((layer, 0))) / (count, 1) for layer in range(count))]
    images = SurfaceImages(values, np.concatenate(uv), np.arange(len(triangles)) > 1)
    return triangles, images


def downward(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Rays from above the stack, somewhat slanted."""
    chance = np.random.default_rng(seed)
    origins = np.concatenate(
        [chance.uniform(0.3, 0.7, (count, 2)), np.full((count, 1), LAYERS + 0.9)], axis=1
    )
    directions = np.concatenate([chance.uniform(-0.04, 0.04, (count, 2)), np.full((count, 1), -1.0)], axis=1)
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_without_cut_outs_there_is_nothing_between_rays_and_embree() -> None:
    triangles, images = stack(np.ones((2, 4, 4)))
    plain = gray_scene(triangles)
    assert isinstance(ray_caster(plain), EmbreeCaster)
    assert isinstance(ray_caster(gray_scene(triangles, images=images)), EmbreeCaster)
    _, partly = stack(np.full((2, 4, 4), 0.9))
    cast = ray_caster(gray_scene(triangles, images=partly))
    assert isinstance(cast, CutOutCaster)


def test_holes_let_pass_and_the_rest_blocks() -> None:
    """Opacities of 0 and 1 in large blocks, rays far from their borders: as the triangles cut out."""
    blocks = np.random.default_rng(1).integers(0, 2, (LAYERS, 2, 2)).astype(float)
    triangles, images = stack(blocks.repeat(64, 1).repeat(64, 2))
    origins, directions = downward(4000)
    crossing = [
        (layer, *(origins + (origins[:, 2] - layer)[:, None] / -directions[:, 2:] * directions)[:, :2].T)
        for layer in range(1, LAYERS + 1)
    ]
    clear = np.all([(np.abs(x - 0.5) > 0.02) & (np.abs(y - 0.5) > 0.02) for _, x, y in crossing], axis=0)
    expected = np.zeros(len(origins), dtype=int)
    for layer, x, y in crossing:
        expected[blocks[layer - 1, (y > 0.5).astype(int), (x > 0.5).astype(int)] > 0] = layer
    cast = CutOutCaster(triangles, images)
    hits = cast.intersect(origins, directions)
    heights = origins[:, 2] + hits.distance * directions[:, 2]
    np.testing.assert_allclose(heights[clear], expected[clear], atol=1e-4)
    np.testing.assert_array_equal(hits.triangle[clear] // 2, expected[clear])
    weights = np.concatenate([1 - hits.barycentric.sum(axis=1, keepdims=True), hits.barycentric], axis=1)
    at = np.einsum("nc,nck->nk", weights, triangles[hits.triangle])
    np.testing.assert_allclose(at, origins + hits.distance[:, None] * directions, atol=1e-5)
    assert hits.front.all()

    to_floor = (LAYERS + 0.9) / -directions[:, 2]
    free = cast.unoccluded(origins, directions, to_floor)
    np.testing.assert_array_equal(free[clear], expected[clear] == 0)
    np.testing.assert_array_equal(cast.passing(origins, directions, to_floor)[clear], expected[clear] == 0)
    assert 0.02 < free.mean() < 0.98
    # Only as far as asked.
    above_all = np.full(len(origins), 0.8)
    assert cast.unoccluded(origins, directions, above_all).all()
    assert cast.intersect(origins[:1], -directions[:1]).triangle[0] == NO_HIT


def test_each_ray_counts_once_however_many_veils_it_meets() -> None:
    """Those of the caster for lamps count along."""
    triangles, images = stack(np.full((LAYERS, 4, 4), 0.5))
    lamps = CutOutCaster(triangles, images)
    cast = CutOutCaster(triangles, images, for_lamps=lamps)
    origins, directions = downward(100)
    reach = np.full(100, 2.0 * LAYERS)
    cast.intersect(origins[:1], directions[:1])
    assert cast.rays == 1
    cast.unoccluded(origins[:10], directions[:10], reach[:10])
    assert cast.rays == 11
    cast.passing(origins, directions, reach)
    assert (cast.rays, lamps.rays) == (111, 0)
    cast.for_lamps.intersect(origins, directions)
    assert (cast.rays, lamps.rays) == (211, 100)


def test_veils_multiply() -> None:
    """The share that passes is the product of 1 − α, exactly; rays pass as often, and independently."""
    opacity = np.array([0.1, 0.5, 0.3, 0.0, 0.6])
    triangles, images = stack(np.ones((LAYERS, 4, 4)) * opacity[:, None, None])
    cast = CutOutCaster(triangles, images)
    origins, directions = downward(40_000)
    to_floor = (LAYERS + 0.9) / -directions[:, 2]
    through = np.prod(1 - opacity)
    np.testing.assert_allclose(cast.passing(origins, directions, to_floor), through, rtol=1e-5)
    assert cast.unoccluded(origins, directions, to_floor).mean() == pytest.approx(through, abs=0.005)
    layer = cast.intersect(origins, directions).triangle // 2
    # From above: the fifth stops 0.6, the third 0.3 of the rest, …
    left = 1.0
    for number in range(LAYERS, 0, -1):
        assert (layer == number).mean() == pytest.approx(left * opacity[number - 1], abs=0.01)
        left *= 1 - opacity[number - 1]
    assert (layer == 0).mean() == pytest.approx(left, abs=0.01)
    hinted = cast.passing(origins, directions, to_floor, 1e-3)
    np.testing.assert_allclose(hinted, through * (1 - 1e-3), rtol=1e-5)


def test_faint_light_goes_on_by_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Behind forty veils: as much light in the mean, for a fraction of the work."""
    count, opacity = 40, 0.3
    triangles, images = stack(np.full((count, 4, 4), opacity))
    triangles = triangles * (1, 1, LAYERS / count)
    meetings: list[int] = []
    intersect = EmbreeCaster.intersect

    def counted(self: EmbreeCaster, origins: np.ndarray, directions: np.ndarray) -> Hits:
        meetings.append(len(origins))
        return intersect(self, origins, directions)

    monkeypatch.setattr(EmbreeCaster, "intersect", counted)
    cast = CutOutCaster(triangles, images)
    origins, directions = downward(100_000)
    to_floor = (LAYERS + 0.9) / -directions[:, 2]
    passed = cast.passing(origins, directions, to_floor)
    through = (1 - opacity) ** count
    assert sum(meetings) < 0.4 * count * len(origins)
    # Each has come to its end on the way, or has about as much as it goes on with.
    assert passed.max() <= FAINT * 1.0001
    assert (np.isclose(passed, ENDED) | (passed > FAINT * (1 - opacity) * 0.999)).all()
    off = 4 * passed.std() / np.sqrt(len(passed))
    assert -off < passed.mean() - through < ENDED + off
    halfway = np.full(len(origins), 0.5 * LAYERS + 0.9)
    ahead = cast.passing(origins, np.broadcast_to((0.0, 0.0, -1.0), origins.shape), halfway)
    expected = (1 - opacity) ** (count // 2)
    assert ahead.mean() == pytest.approx(expected, abs=ENDED + 4 * ahead.std() / np.sqrt(len(ahead)))
    assert ahead.mean() == pytest.approx(expected, rel=0.1)


def test_rays_are_stopped_alike_however_they_are_divided() -> None:
    triangles, images = stack(np.random.default_rng(2).random((LAYERS, 8, 8)))
    origins, directions = downward(1000)
    whole = CutOutCaster(triangles, images, threads=2).intersect(origins, directions)
    cast = CutOutCaster(triangles, images, threads=1)
    for rows in (slice(0, 300), slice(300, 1000)):
        part = cast.intersect(origins[rows], directions[rows])
        np.testing.assert_array_equal(part.triangle, whole.triangle[rows])
        assert part.distance.tobytes() == whole.distance[rows].tobytes()


def test_grazing_rays_meet_each_veil_once() -> None:
    """Rays that leave a crossed triangle so flat that rounding meets it again are not weakened twice."""
    triangles, images = stack(np.full((LAYERS, 4, 4), 0.5))
    angle = np.random.default_rng(3).uniform(0, 2 * np.pi, 5000)
    flat = np.stack([np.cos(angle), np.sin(angle), np.full(5000, -3e-3)], axis=1)
    directions = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    origins = np.tile([0.51, 0.47, LAYERS + 3e-4], (5000, 1))
    share = CutOutCaster(triangles, images).passing(origins, directions, np.full(5000, 0.4))
    assert set(np.unique(share)) <= {0.5, 1.0}
    met = BruteForceCaster(triangles).unoccluded(origins, directions, np.full(5000, 0.4))
    assert (share[~met] == 0.5).mean() > 0.95


@pytest.mark.parametrize(("apart", "from_above", "from_below"), [(0.0, "021", "102"), (4e-7, "210", "012")])
def test_veils_in_one_place_multiply_too(apart: float, from_above: str, from_below: str) -> None:
    """Rays that go on behind a veil do not miss those in the same place; the outermost comes first."""
    opacity = np.array([0.3, 0.6, 0.5])
    veil = rectangle((0, 0, 1), (1, 0, 0), (0, 1, 0))
    other = rectangle((1, 0, 1), (0, 1, 0), (-1, 0, 0))
    lift = np.array((0.0, 0.0, apart))
    triangles = np.concatenate([veil, other[:, ::-1] + lift, other + 2 * lift])
    values = image(1, 0.5, 0.0, opacity[None], wide=3)
    middles = np.repeat((np.arange(3) + 0.5) / 3, 2)
    uv = np.stack([np.repeat(middles[:, None], 3, axis=1), np.full((6, 3), 0.5)], axis=2)
    images = SurfaceImages(values, uv, np.ones(6, dtype=bool))
    cast = ray_caster(gray_scene(triangles, two_sided=True, images=images))
    origins, directions = downward(40_000)
    far = np.full(len(origins), 9.0)
    np.testing.assert_allclose(cast.passing(origins, directions, far), np.prod(1 - opacity), rtol=1e-5)
    for order, sign in ((from_above, 1), (from_below, -1)):
        hits = cast.intersect(origins * (1, 1, sign) + (0, 0, 1 - sign), directions * (1, 1, sign))
        left = 1.0
        for number in map(int, order):
            met = hits.triangle // 2 == number
            assert met.mean() == pytest.approx(left * opacity[number], abs=0.01)
            assert (hits.front[met] == ((number == 1) == (sign < 0))).all()
            left *= 1 - opacity[number]
