"""Form factors against closed forms, published values and the identities they obey."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from radiosity_addon.form_factors.formulas import (
    cap_cosine,
    disk_factor,
    point_to_ellipse,
    point_to_polygon,
    triangle_to_triangle,
)
from tests.vectors import areas_of, normals_of, random_rotation, unit_rows

SQUARE_ABOVE = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 0.0, 1.0]])
"""Unit square at height 1 whose front looks down."""


def factor(
    point: tuple[float, ...], normal: tuple[float, ...], polygon: np.ndarray, both_sides: bool = False
) -> float:
    """Return one point's factor to one polygon."""
    unit = np.array([normal], float) / np.linalg.norm(normal)
    return float(
        point_to_polygon(np.array([point], float), unit, np.asarray(polygon, float)[None], both_sides)[0]
    )


def quadrature(point: np.ndarray, normal: np.ndarray, polygon: np.ndarray, steps: int = 300) -> float:
    """Integrate cosθ cosθ'/(π r²) over a polygon by midpoints on its signed fan of triangles."""
    grid = (np.arange(steps) + 0.5) / steps
    u, v = (axis.ravel() for axis in np.meshgrid(grid, grid))
    total = 0.0
    for second, third in pairwise(polygon[1:]):
        cross = np.cross(second - polygon[0], third - second)
        places = polygon[0] + u[:, None] * (second - polygon[0] + v[:, None] * (third - second))
        to = places - point
        kernel = np.maximum(to @ normal, 0) * -(to @ cross) / (np.pi * np.einsum("ij,ij->i", to, to) ** 2)
        total += float((kernel * u).mean())
    return max(total, 0.0)


# --- point to polygon -------------------------------------------------------------------------


def test_point_below_a_unit_square() -> None:
    """Published values, and the closed form under the corner: 2/π · a/√(1+a²) atan(…) over 2."""
    assert factor((0, 0, 0), (0, 0, 1), SQUARE_ABOVE) == pytest.approx(0.1385316060, abs=1e-9)
    assert factor((0.5, 0.5, 0), (0, 0, 1), SQUARE_ABOVE) == pytest.approx(0.2394564705, abs=1e-9)
    assert factor((0, 0, 0), (0, 0, 1), SQUARE_ABOVE) == pytest.approx(
        np.arctan(1 / np.sqrt(2)) / (np.sqrt(2) * np.pi), abs=1e-14
    )


def test_room_of_cie_171_seen_from_wall_and_ceiling() -> None:
    """CIE 171:2006 case 5.6: a 4 m × 4 m floor from a wall and the ceiling, in percent."""
    floor = np.array([[0.0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]])
    wall = {0.75: 35.901, 1.25: 27.992, 1.75: 21.639, 2.25: 16.716, 2.75: 12.967}
    for z, percent in wall.items():
        assert 100 * factor((2, 0, z), (0, 1, 0), floor) == pytest.approx(percent, abs=1e-3)
    for y, percent in {0.25: 26.80, 0.75: 30.94, 1.25: 33.98, 1.75: 35.57}.items():
        assert 100 * factor((2, y, 3), (0, 0, -1), floor) == pytest.approx(percent, abs=1e-2)


def test_only_the_front_counts_unless_requested() -> None:
    behind = SQUARE_ABOVE[::-1]
    assert factor((0.5, 0.5, 0), (0, 0, 1), behind) == 0.0
    assert factor((0.5, 0.5, 0), (0, 0, 1), behind, both_sides=True) == pytest.approx(0.2394564705, abs=1e-9)
    assert factor((0.5, 0.5, 2), (0, 0, -1), behind) == pytest.approx(0.2394564705, abs=1e-9)
    assert factor((0.5, 0.5, 0), (0, 0, -1), SQUARE_ABOVE, both_sides=True) == 0.0


@pytest.mark.parametrize("corners", [3, 5])
def test_random_receivers_and_horizons_against_quadrature(corners: int) -> None:
    rng = np.random.default_rng(corners)
    seen = 0
    for _ in range(40):
        angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
        flat = np.stack([np.cos(angle), np.sin(angle), np.zeros(corners)], axis=-1) * rng.uniform(0.5, 3)
        polygon = flat @ random_rotation(rng) + rng.normal(size=3)
        point, normal = rng.normal(size=3), unit_rows(rng, 1)[0]
        expected = quadrature(point, normal, polygon)
        if expected < 0.5:  # midpoints are too coarse where the point nearly lies on the polygon
            assert factor(tuple(point), tuple(normal), polygon) == pytest.approx(expected, abs=2e-5)
            seen += expected > 0
    assert seen >= 5


def test_concave_polygon_cut_by_the_horizon_is_the_sum_of_its_parts() -> None:
    """A U whose arms cross the horizon separately: four crossings, two closing edges."""
    outline = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
    parts = [
        [(0, 0), (3, 0), (3, 1), (0, 1)],
        [(0, 1), (1, 1), (1, 3), (0, 3)],
        [(2, 1), (3, 1), (3, 3), (2, 3)],
    ]
    rng = np.random.default_rng(1)
    cut = 0
    for _ in range(200):
        turn, shift = random_rotation(rng), rng.normal(size=3)
        place = [
            np.array([(x - 1.5, y - 1.5, 0.0) for x, y in part]) @ turn + shift for part in (outline, *parts)
        ]
        point, normal = tuple(rng.normal(size=3)), tuple(unit_rows(rng, 1)[0])
        whole, *pieces = [factor(point, normal, polygon) for polygon in place]
        assert whole == pytest.approx(sum(pieces), abs=1e-12)
        heights = (place[0] - point) @ normal
        cut += (np.diff(np.sign(heights), append=np.sign(heights[0])) != 0).sum() == 4 and whole > 0
    assert cut > 3


def test_splitting_a_polygon_changes_nothing() -> None:
    rng = np.random.default_rng(2)
    count = 3000
    triangles = rng.normal(size=(count, 3, 3))
    points, normals = rng.normal(size=(count, 3)), unit_rows(rng, count)
    a, b, c = triangles.transpose(1, 0, 2)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    total = sum(point_to_polygon(points, normals, np.stack(part, axis=1)) for part in parts)
    np.testing.assert_allclose(total, point_to_polygon(points, normals, triangles), atol=1e-12)


def test_a_closed_surface_around_a_point_fills_the_hemisphere() -> None:
    """Σ F = 1 from any point inside a tetrahedron, whatever the normal, near faces and edges too."""
    rng = np.random.default_rng(3)
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = corners[np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])]  # fronts look inwards
    weights = rng.dirichlet(np.ones(4), size=500) ** 2
    points = (weights / weights.sum(axis=1)[:, None]) @ corners
    normals = unit_rows(rng, 500)
    total = sum(point_to_polygon(points, normals, np.broadcast_to(face, (500, 3, 3))) for face in faces)
    np.testing.assert_allclose(total, 1.0, atol=1e-9)


def test_a_wall_standing_on_the_receiver_is_cut_exactly_at_its_foot() -> None:
    """Perpendicular rectangle with its edge in the receiver's plane: F = (atan(1/Y) − A atan A) / 2π."""
    height, width, distance = 2.0, 1.5, 0.7
    wall = np.array(
        [[0.0, distance, 0], [width, distance, 0], [width, distance, height], [0, distance, height]]
    )
    y = distance / width
    slant = 1 / np.hypot(height / width, y)
    expected = (np.arctan(1 / y) - y * slant * np.arctan(slant)) / (2 * np.pi)
    assert factor((0, 0, 0), (0, 0, 1), wall) == pytest.approx(expected, abs=1e-12)
    sunk = wall - [0, 0, 0.3]
    raised = np.where(wall[:, 2:] > 0, sunk, wall)
    assert factor((0, 0, 0), (0, 0, 1), sunk) == pytest.approx(
        factor((0, 0, 0), (0, 0, 1), raised), abs=1e-12
    )


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6, 1e-8])
def test_factor_near_the_polygon_tends_to_what_a_half_space_fills(gap: float) -> None:
    """Just above the middle 1, just above an edge 1/2; at the foot of a wall the floor fills 1/2."""
    assert factor((0.5, 0.5, 1 - gap), (0, 0, 1), SQUARE_ABOVE) == pytest.approx(1.0, abs=10 * gap**2)
    assert factor((0.5, 0.0, 1 - gap), (0, 0, 1), SQUARE_ABOVE) == pytest.approx(0.5, abs=gap)
    assert factor((0.5, 0.0, 1 - gap), (0, 1, 0), SQUARE_ABOVE) == pytest.approx(0.5, abs=2 * gap)


def test_points_in_the_plane_see_it_in_contact_only() -> None:
    inside, edge, corner, outside = (0.5, 0.5, 1), (0.5, 0, 1), (0, 0, 1), (3, 0, 1)
    for point, expected in ((inside, 1.0), (edge, 0.5), (corner, 0.25), (outside, 0.0)):
        assert factor(point, (0, 0, 1), SQUARE_ABOVE) == pytest.approx(expected, abs=1e-12)
    for point in (inside, edge, corner, outside):
        assert factor(point, (0, 0, -1), SQUARE_ABOVE) == 0.0
        assert factor(point, (1, 0, 0), SQUARE_ABOVE) == 0.0
        assert factor(point, (0, 1, 1), SQUARE_ABOVE) == 0.0


def test_degenerate_polygons_give_nothing() -> None:
    line = np.array([[0.0, 0, 1], [1, 0, 1], [2, 0, 1]])
    for polygon in (line, np.ones((3, 3)), np.zeros((4, 3))):
        assert factor((0, 0, 0), (0, 0, 1), polygon, both_sides=True) == 0.0
    doubled = np.concatenate([SQUARE_ABOVE[:1], SQUARE_ABOVE])
    assert factor((0, 0, 0), (0, 0, 1), doubled) == pytest.approx(0.1385316060, abs=1e-9)


def test_small_far_polygons_keep_their_relative_accuracy() -> None:
    side, far = 1e-3, 1e3
    tiny = (SQUARE_ABOVE - [0.5, 0.5, 1]) * side + [0, 0, far]
    assert factor((0, 0, 0), (0, 0, 1), tiny) == pytest.approx(side**2 / (np.pi * far**2), rel=1e-6)


def test_chunks_do_not_matter_and_empty_input_is_fine() -> None:
    rng = np.random.default_rng(5)
    count = 12000
    points, normals, triangles = (
        rng.normal(size=(count, 3)),
        unit_rows(rng, count),
        rng.normal(size=(count, 3, 3)),
    )
    whole = point_to_polygon(points, normals, triangles)
    pieces = [point_to_polygon(points[i::7], normals[i::7], triangles[i::7]) for i in range(7)]
    assert all(np.array_equal(whole[i::7], piece) for i, piece in enumerate(pieces))
    assert point_to_polygon(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 3, 3))).shape == (0,)
    assert triangle_to_triangle(np.empty((0, 3, 3)), np.empty((0, 3, 3))).shape == (0,)


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match="polygons"):
        point_to_polygon(np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(ValueError, match="normals"):
        point_to_polygon(np.zeros((2, 3)), np.zeros((1, 3)), np.zeros((2, 3, 3)))
    with pytest.raises(ValueError, match="sources"):
        triangle_to_triangle(np.zeros((2, 3, 3)), np.zeros((1, 3, 3)))


# --- caps and ellipses ------------------------------------------------------------------------


def test_cap_is_the_disk_that_faces_the_point() -> None:
    """Closed form against the outline integral, through every stage of setting."""
    radius, distance = 0.5, 0.7
    sine = radius / np.hypot(radius, distance)
    for angle in np.linspace(0, np.pi, 41):
        normal = np.array([[np.sin(angle), 0, np.cos(angle)]])
        disk = point_to_ellipse(np.zeros((1, 3)), normal, (0, 0, distance), (0, radius, 0), (radius, 0, 0))[0]
        assert cap_cosine(np.cos(angle), sine) * sine**2 == pytest.approx(disk, abs=1e-9)


def test_cap_closed_forms_and_limits() -> None:
    alpha = 0.6
    sine = np.sin(alpha)
    assert cap_cosine(0.0, sine) == pytest.approx(
        (alpha - sine * np.cos(alpha)) / (np.pi * sine**2), abs=1e-14
    )
    assert cap_cosine([1.0, 0.9, -0.7], sine) == pytest.approx([1.0, 0.9, 0.0], abs=1e-15)
    cosine = np.linspace(-1, 1, 21)
    assert cap_cosine(cosine, 1.0) == pytest.approx((1 + cosine) / 2, abs=1e-12)  # a whole hemisphere of sky
    assert cap_cosine(cosine, 0.0) == pytest.approx(np.maximum(cosine, 0), abs=0)
    assert cap_cosine(cosine, 1e-6) == pytest.approx(np.maximum(cosine, 0), abs=1e-6)


@pytest.mark.parametrize("edge", [-1.0, 1.0])
def test_cap_is_continuous_where_it_touches_the_horizon(edge: float) -> None:
    for sine in (0.01, 0.3, 0.99):
        below, above = cap_cosine(edge * sine + np.array([-1e-9, 1e-9]), sine)
        assert above == pytest.approx(below, abs=1e-6)


def test_ellipse_is_the_limit_of_polygons() -> None:
    rng = np.random.default_rng(7)
    count, center = 80, np.array([0.3, -0.2, 0.5])
    u, v = np.array([1.0, 0.2, 0.0]), np.array([-0.1, 0.5, 0.3])
    points, normals = center + 1.5 * rng.normal(size=(count, 3)), unit_rows(rng, count)
    angle = np.arange(2048) * (2 * np.pi / 2048)
    outline = center + np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    polygons = np.broadcast_to(outline, (count, *outline.shape))
    ellipse = point_to_ellipse(points, normals, center, u, v)
    assert (ellipse > 0).sum() > 15
    np.testing.assert_allclose(ellipse, point_to_polygon(points, normals, polygons), atol=2e-6)


# --- far approximation ------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_disk_factor_approaches_the_exact_one_with_the_square_of_distance(kind: type) -> None:
    triangle = np.array([[0.0, 0, 0], [0, 1, 0], [1, 0.2, 0]])
    center = triangle.mean(axis=0)
    (normal,), (area,) = normals_of(triangle[None]), areas_of(triangle[None])
    way = np.array([0.3, -0.4, -1.0]) / np.linalg.norm([0.3, -0.4, -1.0])
    facing = -way + np.array([0.2, 0.1, 0])
    facing /= np.linalg.norm(facing)
    errors = []
    for distance in (4.0, 8.0, 16.0):
        point = center + distance * way
        exact = factor(tuple(point), tuple(facing), triangle)
        rows = [np.array([row], dtype=kind) for row in (point, facing, center, normal, area)]
        estimate = disk_factor(*rows)
        assert estimate.dtype == kind
        errors.append(abs(float(estimate[0]) / exact - 1))
    assert errors[0] < 0.02
    assert errors[1] / errors[2] > 3
    assert disk_factor(point[None], -facing[None], center[None], normal[None], np.array([area]))[0] == 0
    assert disk_factor(point[None], facing[None], center[None], -normal[None], np.array([area]))[0] == 0
    assert disk_factor(center[None], facing[None], center[None], normal[None], np.array([area]))[0] == 0
