"""What points receive from elements: shared out over corners, and by visibility."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.form_factors.formulas import point_to_polygon
from radiosity_addon.lights.sun_and_sky import EnvironmentLight, PointLight
from radiosity_addon.numerics.triangles import split_in_four
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver.equations.point_exchange import corner_factors, visible_share
from radiosity_addon.solver.links.light_at_points import lamp_irradiance
from tests.rooms import rectangle

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
UP = np.array([0.0, 0, 1])


def facing(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    count = len(points)
    return corner_factors(points, normals, np.tile(TRIANGLE, (count, 1, 1)), np.tile(UP, (count, 1)))


def by_parts(point: np.ndarray, normal: np.ndarray, generations: int = 7) -> np.ndarray:
    """The three corner factors as a sum over 4^generations parts."""
    parts, weights = TRIANGLE[None], np.eye(3)[None]
    for _ in range(generations):
        parts = split_in_four(parts).reshape(-1, 3, 3)
        weights = split_in_four(weights).reshape(-1, 3, 3)
    count = len(parts)
    factors = point_to_polygon(np.tile(point, (count, 1)), np.tile(normal, (count, 1)), parts)
    return np.asarray(factors @ weights.mean(axis=1))


@pytest.mark.parametrize(
    ("point", "within"),
    [((0.3, 0.3, 5.0), 2e-6), ((0.3, 0.3, 2.0), 4e-6), ((0.2, 0.9, 1.0), 6e-6), ((0.3, 0.2, 0.1), 1e-5),
     ((0.9, 0.05, 0.02), 5e-3)],
)  # fmt: skip
def test_corner_factors_against_many_parts(point: tuple, within: float) -> None:
    """At every distance, straight below and seen aslant."""
    for normal in (-UP, np.array([0.6, 0.0, -0.8])):
        found = facing(np.array([point]), normal[None])[0]
        np.testing.assert_allclose(found, by_parts(np.asarray(point), normal), atol=within)


def test_corner_factors_sum_to_the_whole() -> None:
    """Hats sum to 1: so do their factors to Lambert's, exactly, at any point."""
    rng = np.random.default_rng(4)
    points = rng.uniform((-2, -2, -0.2), (3, 3, 3), (500, 3))
    normals = rng.normal(size=(500, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    factors = facing(points, normals)
    whole = point_to_polygon(points, normals, np.tile(TRIANGLE, (500, 1, 1)))
    assert (whole > 0).sum() > 100
    np.testing.assert_allclose(factors.sum(axis=1), whole, atol=1e-14)
    assert (factors >= 0).all()


def test_a_symmetric_point_sees_symmetric_corners() -> None:
    factors = facing(np.array([[0.25, 0.25, 1.0]]), -UP[None])[0]
    assert factors[1] == pytest.approx(factors[2], rel=1e-12)


def share(blocker: np.ndarray, heights: np.ndarray, seed: int = 0) -> np.ndarray:
    """Visibility of the triangle from points above its inside, at many keys."""
    triangles = np.concatenate([TRIANGLE[None], blocker])
    points = np.stack([np.full_like(heights, 0.25), np.full_like(heights, 0.25), heights], axis=1)
    count = len(points)
    return visible_share(
        EmbreeCaster(triangles), points, np.tile(-UP, (count, 1)), np.tile(TRIANGLE, (count, 1, 1)),
        np.tile(UP, (count, 1)), np.arange(count), seed,
    )  # fmt: skip


def test_visibility_of_what_is_open_and_what_is_hidden() -> None:
    aside = rectangle((5, 5, 5), (1, 0, 0), (0, 1, 0))
    between = rectangle((-3, -3, 0.5), (7, 0, 0), (0, 7, 0))
    heights = np.linspace(0.6, 3.0, 50)
    assert (share(aside, heights) == 1.0).all()
    assert (share(between, heights) == 0.0).all()


def test_visibility_of_what_is_half_hidden() -> None:
    """A screen halfway up hides the part x < 1/2: exact by form factors, on average by rays."""
    screen = rectangle((-3, -3, 1.0), (3.375, 0, 0), (0, 7, 0))
    heights = np.full(4000, 2.0)
    found = share(screen, heights)
    point, down = np.array([[0.25, 0.25, 2.0]]), -UP[None]
    hidden_to = 0.25 + 2.0 * (0.375 - 0.25)
    seen = np.array([[hidden_to, 0, 0], [1, 0, 0], [hidden_to, 1 - hidden_to, 0]])
    exact = point_to_polygon(point, down, seen[None]) / point_to_polygon(point, down, TRIANGLE[None])
    assert found.mean() == pytest.approx(exact[0], abs=0.01)
    assert found.std() < 0.15
    assert (share(screen, heights, seed=1) != found).any()


def test_in_contact_nothing_is_between() -> None:
    """A point on the triangle itself: no ray has a way to go, so nothing blocks it."""
    found = visible_share(
        EmbreeCaster(TRIANGLE[None]), np.array([[0.3, 0.3, 0.0]]), -UP[None], TRIANGLE[None], UP[None],
        np.zeros(1, int), 0,
    )  # fmt: skip
    assert found[0] == 1.0


def test_no_pairs() -> None:
    none, corners = np.zeros((0, 3)), np.zeros((0, 3, 3))
    caster = EmbreeCaster(TRIANGLE[None])
    assert visible_share(caster, none, none, corners, none, np.zeros(0, int), 0).shape == (0,)
    assert corner_factors(none, none, corners, none).shape == (0, 3)


def test_lamps_at_points() -> None:
    """H = Φ cosθ / (4π d²), 0 behind a screen; a sky by the share of it that is open."""
    screen = rectangle((2, -1, 0.5), (2, 0, 0), (0, 2, 0))
    caster = EmbreeCaster(screen)
    points, up = np.array([[0.0, 0, 0], [3.0, 0, 0]]), np.tile(UP, (2, 1))
    lamp = PointLight((0.0, 0, 2), (100.0, 50.0, 0.0))
    direct = lamp_irradiance([lamp], points, up, caster, seed=0)
    np.testing.assert_allclose(direct[0], np.array([100.0, 50.0, 0.0]) / (16 * np.pi), rtol=1e-6)
    behind = lamp_irradiance([PointLight((3.0, 0, 2), 100.0)], points, up, caster, seed=0)
    assert (behind[1] == 0).all()
    assert (behind[0] > 0).all()
    sky = lamp_irradiance([EnvironmentLight(1.0)], points, up, caster, seed=0)
    blocked = point_to_polygon(
        points, up, np.tile([[2.0, -1, 0.5], [2, 1, 0.5], [4, 1, 0.5], [4, -1, 0.5]], (2, 1, 1))
    )
    np.testing.assert_allclose(sky[:, 0], np.pi * (1 - blocked), atol=0.08)
