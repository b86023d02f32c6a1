"""Back to back in one plane: a ray meets the surface that faces it, whichever is listed first."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.rays.caster import NO_HIT, RayCaster, surface_offset
from radiosity_addon.rays.coplanar import COPY_LIFT, facing_copies
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.scene.opacity import ray_caster
from tests.rooms import box_room, gray_scene, rectangle, solid_box

OFFSET = 1e-5
LOWER = 2 * 5**2
"""Triangles of the sheet that looks down."""


def turned(triangles: np.ndarray, seed: int) -> np.ndarray:
    """Return triangles turned at random and moved away: rounding decides what is met first."""
    rng = np.random.default_rng(seed)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation *= np.sign(np.linalg.det(rotation))
    return np.asarray(triangles @ rotation.T + rng.uniform(-20, 20, 3))


def two_sheets(order: int) -> np.ndarray:
    """A sheet of 50 triangles that looks down, and one of 18 that looks up in the same place."""
    down = rectangle((0, 0, 0), (0, 1, 0), (1, 0, 0), 5)
    up = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), 3)
    return np.concatenate([down, up][::order])


def caster(triangles: np.ndarray, two_sided: bool | np.ndarray = False) -> RayCaster:
    return ray_caster(gray_scene(triangles, two_sided=two_sided))


def rays(triangles: np.ndarray, side: int, count: int = 4000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rays from one side onto the first sheet: origins, directions, and where they meet it."""
    rng = np.random.default_rng(7)
    a, b, c = triangles[rng.integers(0, len(triangles), count)].transpose(1, 0, 2)
    u, v = np.sort(rng.uniform(0.01, 0.99, (2, count)), axis=0)[..., None]
    at = a + u * (b - a) + (v - u) * (c - a)
    normal = np.cross(b - a, c - a)[0]
    away = rng.normal(size=(count, 3))
    away *= np.sign(side * (away @ normal))[:, None]
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    return at + rng.uniform(0.01, 3, (count, 1)) * away, -away, at


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("order", [1, -1])
def test_rays_meet_the_sheet_that_faces_them(order: int, seed: int) -> None:
    triangles = turned(two_sheets(order), seed)
    looks = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    first = looks @ looks[0] > 0
    for side in (1, -1):
        origins, directions, at = rays(triangles[first], side)
        hits = caster(triangles).intersect(origins, directions)
        assert (hits.triangle != NO_HIT).all()
        assert hits.front.all()
        np.testing.assert_array_equal(first[hits.triangle], side > 0)
        # The triangle is the scene's, and so is the place on it.
        a, b, c = triangles[hits.triangle].transpose(1, 0, 2)
        second, third = hits.barycentric.T[..., None]
        off = np.linalg.norm(a + second * (b - a) + third * (c - a) - at, axis=1)
        assert np.median(off) < 1e-5
        assert not caster(triangles).unoccluded(origins, directions, np.full(len(at), 10.0)).any()


def test_without_facing_copies_many_would_not() -> None:
    """Embree alone reports either sheet: the test above can fail."""
    triangles = turned(two_sheets(1), 0)
    origins, directions, _ = rays(triangles[:LOWER], 1)
    assert EmbreeCaster(triangles).intersect(origins, directions).front.mean() < 0.9
    # Two-sided sheets in the air count by their fronts.
    assert caster(triangles, two_sided=True).intersect(origins, directions).front.all()


def test_a_two_sided_sheet_hides_the_black_back_in_it() -> None:
    """Looked at from where both its sides and a black back lie, it is met, be it by its back."""
    triangles = turned(np.concatenate([two_sheets(1)[:LOWER]] * 2), 1)
    two_sided = np.arange(2 * LOWER) >= LOWER
    origins, directions, _ = rays(triangles[:LOWER], -1)
    hits = caster(triangles, two_sided).intersect(origins, directions)
    assert (hits.triangle >= LOWER).all()
    assert not hits.front.any()


def test_copies_are_made_where_a_black_back_lies_and_nowhere_else() -> None:
    sheets = two_sheets(1) - 0.5
    count = len(sheets)
    rows, copies = facing_copies(sheets, np.zeros(count, dtype=bool), OFFSET)
    np.testing.assert_array_equal(np.sort(rows), np.arange(count))
    np.testing.assert_allclose(np.abs(copies - sheets[rows])[..., 2], COPY_LIFT * OFFSET, rtol=1e-6)
    np.testing.assert_allclose((copies - sheets[rows])[..., :2], 0.0, atol=1e-15)
    for alone in (sheets[:LOWER], box_room()[0] - 0.5, solid_box((0, 0, 0), (1, 1, 1)) - 0.5):
        assert len(facing_copies(alone, np.zeros(len(alone), dtype=bool), OFFSET)[0]) == 0
    assert len(facing_copies(sheets, np.ones(count, dtype=bool), OFFSET)[0]) == 0
    # Where there is no extent, or no area, nothing is divided by it.
    assert len(facing_copies(np.zeros((2, 3, 3)), np.zeros(2, dtype=bool), OFFSET)[0]) == 0


def test_nothing_opens_between_boxes_that_touch() -> None:
    """Outside two stacked boxes no ray comes in, inside none gets out, however it starts."""
    boxes = np.concatenate([solid_box((0, 0, 0), (1, 1, 1)), solid_box((0, 0, 1), (1, 1, 2))])
    cast = caster(boxes)
    rng = np.random.default_rng(3)
    toward = rng.uniform(0, 1, (200_000, 3))
    toward[:, 2] = 1.0 + rng.normal(size=len(toward)) * 0.5 * surface_offset(boxes)
    way = rng.normal(size=(len(toward), 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    outside = cast.intersect(toward + 4.0 * way, -way)
    assert (outside.triangle != NO_HIT).all()
    assert outside.front.all()
    within = np.linspace(0.2, 0.8, 50)[:, None] * np.ones(3)
    inside = cast.intersect(np.repeat(within, 4000, axis=0), way)
    assert (inside.triangle != NO_HIT).all()
    met = np.repeat(within, 4000, axis=0) + inside.distance[:, None] * way
    assert (np.abs(met - 0.5) < 0.5 + 2 * surface_offset(boxes)).all()


def test_a_caster_of_some_triangles_still_knows_their_rows() -> None:
    sheets = turned(two_sheets(1), 2)
    count = len(sheets)
    both = np.concatenate([sheets + 5.0, sheets])
    in_bounces = np.arange(2 * count) >= count
    scene = gray_scene(both, in_bounces=in_bounces)
    origins, directions, _ = rays(sheets[:LOWER], 1, 500)
    hits = ray_caster(scene).intersect(origins, directions)
    assert hits.front.all()
    assert ((hits.triangle >= count) & (hits.triangle < count + LOWER)).all()
