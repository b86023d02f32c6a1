"""Geometry term, kernel, throughput and visibility of pairs of points."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.form_factors.formulas import point_to_polygon
from radiosity_addon.form_factors.geometry_kernel import (
    geometry_term,
    kernel,
    ray_geometry_term,
    throughput,
    visibility_of,
)
from radiosity_addon.rays.caster import BruteForceCaster, RayCaster
from radiosity_addon.rays.embree import EmbreeCaster
from tests.rooms import box_room, rectangle, solid_box

CUBE_FACTOR = 0.19982489569838746
"""Between opposite faces of a cube: the closed form for parallel squares at a distance of their side."""


def random_pairs(count: int = 500) -> list[np.ndarray]:
    rng = np.random.default_rng(5)
    arrays = [rng.normal(size=(count, 3)) for _ in range(4)]
    for row in (1, 3):
        arrays[row] /= np.linalg.norm(arrays[row], axis=1, keepdims=True)
    return arrays


def test_it_is_symmetric_and_falls_with_the_square() -> None:
    """(2.21); twice as far is a quarter."""
    at, normal, other, other_normal = random_pairs()
    value = geometry_term(at, normal, other, other_normal)
    assert (value > 0).sum() > 100
    np.testing.assert_allclose(geometry_term(other, other_normal, at, normal), value, rtol=1e-13)
    np.testing.assert_allclose(geometry_term(2 * at, normal, 2 * other, other_normal), value / 4, rtol=1e-13)
    np.testing.assert_allclose(kernel(at, normal, other, other_normal), value / np.pi, rtol=1e-15)


def test_it_is_zero_where_either_faces_away() -> None:
    at, normal, other, other_normal = random_pairs()
    ahead = np.einsum("nk,nk->n", other - at, normal) > 0
    behind = np.einsum("nk,nk->n", other - at, other_normal) > 0
    np.testing.assert_array_equal(geometry_term(at, normal, other, other_normal) > 0, ahead & ~behind)
    assert geometry_term(np.zeros(3), normal[0], np.zeros(3), normal[0]) == 0


def test_one_ray_gives_the_same() -> None:
    at, normal, other, other_normal = random_pairs()
    distance = np.linalg.norm(other - at, axis=1)
    along = (other - at) / distance[:, None]
    cosine, other_cosine = np.einsum("nk,nk->n", along, normal), -np.einsum("nk,nk->n", along, other_normal)
    np.testing.assert_allclose(
        ray_geometry_term(cosine, other_cosine, distance),
        geometry_term(at, normal, other, other_normal),
        rtol=1e-12,
    )
    assert ray_geometry_term(np.ones(1), np.ones(1), np.zeros(1)) == 0


def test_the_kernel_times_a_small_area_is_its_form_factor() -> None:
    """F of a small triangle is κ dA (2.20, 3.27), with an error of its size over distance squared."""
    at, normal, other, other_normal = random_pairs(100)
    tangent = np.cross(other_normal, [0.3, 0.5, 0.8])
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    bitangent = np.cross(other_normal, tangent)
    angle = 2 * np.pi / 3 * np.arange(3)[None, :, None]
    size = 1e-4 * np.linalg.norm(other - at, axis=1)
    ring = np.cos(angle) * tangent[:, None] + np.sin(angle) * bitangent[:, None]
    area = 0.75 * np.sqrt(3) * size**2
    factor = point_to_polygon(at, normal, other[:, None] + size[:, None, None] * ring)
    expected = kernel(at, normal, other, other_normal) * area
    clear = expected > 1e-3 * expected.max()
    assert clear.sum() > 20
    np.testing.assert_allclose(factor[clear], expected[clear], rtol=1e-5)


def test_throughput_is_solid_angle_times_area_from_either_end() -> None:
    """dω dA = dω' dA' (1.2, 1.3): what makes radiance constant along a ray (1.4)."""
    at, normal, other, other_normal = random_pairs()
    area, other_area = np.full(500, 1e-4), np.full(500, 3e-5)
    geometry = geometry_term(at, normal, other, other_normal)
    along = other - at
    square = np.einsum("nk,nk->n", along, along)
    cosine = np.maximum(np.einsum("nk,nk->n", along, normal), 0) / np.sqrt(square)
    other_cosine = np.maximum(-np.einsum("nk,nk->n", along, other_normal), 0) / np.sqrt(square)
    flow = throughput(geometry, area, other_area)
    np.testing.assert_allclose(flow, (other_cosine * other_area / square) * (cosine * area), rtol=1e-12)
    np.testing.assert_allclose(flow, (cosine * area / square) * (other_cosine * other_area), rtol=1e-12)


def test_throughput_between_two_squares_adds_up_to_their_form_factor() -> None:
    """A F = ∬ κ dA dA' of opposite faces of the unit cube, with the midpoint rule's second order."""
    up, down = np.array([0, 0, 1.0]), np.array([0, 0, -1.0])
    errors = []
    for cells in (4, 8, 16):
        center = (np.arange(cells) + 0.5) / cells
        floor = np.stack([*np.meshgrid(center, center), np.zeros((cells, cells))], axis=-1).reshape(-1, 3)
        geometry = geometry_term(floor[:, None], up, floor[None] + up, down)
        total = throughput(geometry, np.float64(1 / cells**2), np.float64(1 / cells**2)).sum() / np.pi
        errors.append(abs(total - CUBE_FACTOR))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2, atol=0.05)


@pytest.mark.parametrize("kind", [EmbreeCaster, BruteForceCaster])
def test_points_see_each_other_unless_something_is_between(kind: type[RayCaster]) -> None:
    """A screen at half height hides the middle of a floor from the middle of the ceiling."""
    room, _ = box_room()
    screen = rectangle((0.25, 0.25, 0.5), (0.5, 0, 0), (0, 0.5, 0))
    caster = kind(np.concatenate([room, screen]))
    rng = np.random.default_rng(0)
    below, above = np.zeros((400, 3)), np.ones((400, 3))
    below[:, :2], above[:, :2] = rng.uniform(0, 1, (2, 400, 2))
    up, down = np.tile([0.0, 0, 1], (400, 1)), np.tile([0.0, 0, -1], (400, 1))
    middle = 0.5 * (below + above)[:, :2]
    depth = 0.25 - np.abs(middle - 0.5).max(axis=1)  # how far inside the screen the line passes
    clear = np.abs(depth) > 1e-3
    seen = visibility_of(caster, below, up, above, down)
    np.testing.assert_array_equal(seen[clear], (depth < 0)[clear])
    np.testing.assert_array_equal(visibility_of(caster, above, down, below, up)[clear], seen[clear])


def test_nothing_sees_into_a_closed_box() -> None:
    """Right up to where it stands on the floor: the ends leave their surfaces, but stay inside."""
    floor = rectangle((0, 0, 0), (3, 0, 0), (0, 3, 0))
    caster = EmbreeCaster(np.concatenate([floor, solid_box((1, 1, 0), (2, 2, 1))]))
    rng = np.random.default_rng(1)
    covered = np.concatenate([rng.uniform(1.01, 1.99, (200, 2)), np.zeros((200, 1))], axis=1)
    outside = covered + np.array([0, 0, 3.0])
    up = np.tile([0.0, 0, 1], (200, 1))
    assert not visibility_of(caster, covered, up, outside, -up).any()
