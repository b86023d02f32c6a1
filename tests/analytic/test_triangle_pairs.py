"""Triangle-to-triangle factors: published values, reciprocity, closure, touching and crossing pairs."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.form_factors import triangle_pairs
from radiosity_addon.form_factors.formulas import point_to_polygon, triangle_to_triangle
from radiosity_addon.numerics.sampling import points_on_triangles, stratified_square
from tests.rooms import FLOOR, box_room
from tests.vectors import areas_of, normals_of, random_rotation, unit_rows

UP = np.array([0.0, 0.0, 1.0])


def halves(quad: np.ndarray) -> np.ndarray:
    """Cut quads (…, 4, 3) into triangles."""
    return np.asarray(quad, dtype=float)[[[0, 1, 2], [0, 2, 3]]]


def quad_factor(receiver: list[tuple[float, ...]], source: list[tuple[float, ...]]) -> float:
    """Return the factor between two quads from those of their halves."""
    receivers, sources = np.repeat(halves(receiver), 2, axis=0), np.tile(halves(source), (2, 1, 1))
    area = areas_of(receivers)
    return float(area @ triangle_to_triangle(receivers, sources) / area[::2].sum())


def parallel(a: float, b: float, distance: float) -> float:
    below = [(0, 0, 0), (a, 0, 0), (a, b, 0), (0, b, 0)]
    return quad_factor(below, [(0, 0, distance), (0, b, distance), (a, b, distance), (a, 0, distance)])


def hinged(width: float, height: float, length: float, degrees: float) -> float:
    """Factor from a width × length rectangle to a height × length one sharing the long edge."""
    x, z = height * np.cos(np.radians(degrees)), height * np.sin(np.radians(degrees))
    lying = [(0, 0, 0), (width, 0, 0), (width, length, 0), (0, length, 0)]
    return quad_factor(lying, [(0, 0, 0), (0, length, 0), (x, length, z), (x, 0, z)])


@pytest.mark.parametrize(
    ("computed", "published"),
    [
        (parallel(1, 1, 0.5), 0.4152532836),
        (parallel(1, 1, 1), 0.1998248957),
        (parallel(1, 1, 2), 0.0685895888),
        (parallel(2, 1, 1), 0.2858753849),
        (parallel(4, 1, 1), 0.3459614607),
        (hinged(1, 1, 1, 90), 0.2000437761),
        (hinged(2, 1, 1, 90), 0.1164263014),
        (hinged(1, 2, 1, 90), 0.2328526028),
        (hinged(1, 1, 1, 45), 0.4833476955),
        (hinged(1, 1, 1, 120), 0.0866150011),
    ],
)
def test_published_rectangles(computed: float, published: float) -> None:
    """Howell, Catalog of Radiation Heat Transfer Configuration Factors, C-11, C-14 and C-16."""
    assert computed == pytest.approx(published, abs=1e-5)


def test_hinged_strips_tend_to_the_two_dimensional_limit() -> None:
    """Infinitely long equal strips at an angle: F = 1 − sin(angle/2)."""
    for degrees in (30.0, 90.0, 150.0):
        assert hinged(1, 1, 2000, degrees) == pytest.approx(1 - np.sin(np.radians(degrees) / 2), abs=1e-3)


def pairs(kind: str, rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return random pairs that share an edge or a corner, cross each other, or stand apart."""
    first, second = rng.normal(size=(count, 3, 3)), rng.normal(size=(count, 3, 3))
    if kind == "edge":
        second[:, 0], second[:, 1] = first[:, 1], first[:, 0]
    elif kind == "corner":
        second[:, 0] = first[:, 1]
    elif kind == "apart":
        second += 8 * unit_rows(rng, count)[:, None]
    return first, second


KINDS = ("edge", "corner", "crossing", "apart")


@pytest.mark.parametrize("kind", KINDS)
def test_reciprocity(kind: str) -> None:
    first, second = pairs(kind, np.random.default_rng(11), 500)
    there, back = triangle_to_triangle(first, second), triangle_to_triangle(second, first)
    assert (there > 0).mean() > 0.1
    np.testing.assert_allclose(areas_of(first) * there, areas_of(second) * back, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_mean_of_the_point_factor_over_the_receiver(kind: str) -> None:
    first, second = pairs(kind, np.random.default_rng(12), 60)
    samples = 1 << 13
    points = points_on_triangles(first, stratified_square(np.arange(60), samples).astype(float))
    normals = np.repeat(normals_of(first), samples, axis=0)
    factors = point_to_polygon(points.reshape(-1, 3), normals, np.repeat(second, samples, axis=0))
    np.testing.assert_allclose(
        triangle_to_triangle(first, second), factors.reshape(60, -1).mean(axis=1), atol=1.5e-3
    )
    # The samples' own errors average out over the pairs; a bias would not.
    assert triangle_to_triangle(first, second).mean() == pytest.approx(factors.mean(), abs=5e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_quartering_either_triangle_changes_nothing(kind: str) -> None:
    """Additive over the source, area mean over the receiver: no error hides in near pairs."""
    first, second = pairs(kind, np.random.default_rng(13), 200)
    corner = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
    middle = np.array([[0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5]])
    split = np.array([[corner[i], middle[i], middle[i - 1]] for i in range(3)] + [middle])
    whole = triangle_to_triangle(first, second)
    by_source = sum(triangle_to_triangle(first, part @ second) for part in split)
    by_receiver = sum(triangle_to_triangle(part @ first, second) for part in split) / 4
    np.testing.assert_allclose(by_source, whole, atol=1e-4)
    np.testing.assert_allclose(by_receiver, whole, atol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_scale_rotation_and_shift_change_nothing(kind: str) -> None:
    rng = np.random.default_rng(14)
    first, second = pairs(kind, rng, 200)
    factors = triangle_to_triangle(first, second)
    for scale in (1e-4, 1e4):
        np.testing.assert_allclose(triangle_to_triangle(scale * first, scale * second), factors, atol=1e-9)
    turn = random_rotation(rng)
    np.testing.assert_allclose(triangle_to_triangle(first @ turn, second @ turn), factors, atol=1e-9)
    np.testing.assert_allclose(triangle_to_triangle(first + 100, second + 100), factors, atol=1e-7)


def test_far_and_near_rules_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(15)
    shape = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    first = shape @ np.stack([random_rotation(rng) for _ in range(2000)])
    second = shape @ np.stack([random_rotation(rng) for _ in range(2000)]) + 3 * rng.normal(size=(2000, 1, 3))
    mixed = triangle_to_triangle(first, second)
    monkeypatch.setattr(triangle_pairs, "MAX_CUBATURE_RATIO", 0.0)
    outline = triangle_to_triangle(first, second)
    assert (mixed != outline).mean() > 0.05
    np.testing.assert_allclose(mixed, outline, atol=2e-5)


def closure(corners: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return Σ F of every face of a closed surface."""
    triangles = corners[faces]
    count = len(faces)
    row, column = np.divmod(np.arange(count * count), count)
    return triangle_to_triangle(triangles[row], triangles[column]).reshape(count, count).sum(axis=1)


CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
CUBE_FACES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
CUBE_TRIANGLES = CUBE_FACES[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)  # fronts look inwards


@pytest.mark.parametrize("stretch", [(1, 1, 1), (1, 1, 1e-2), (1, 50, 1)])
def test_closure_of_a_box(stretch: tuple[float, ...]) -> None:
    np.testing.assert_allclose(closure(CUBE * stretch, CUBE_TRIANGLES), 1.0, atol=1e-4)
    assert closure(CUBE * stretch, CUBE_TRIANGLES[:, ::-1]).max() == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_closure_of_random_convex_enclosures(seed: int) -> None:
    """A tetrahedron around the origin, and an octahedron of random corners on the axes."""
    rng = np.random.default_rng(seed)
    inwards = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) @ (
        rng.normal(size=(3, 3)) + 2 * np.eye(3)
    )
    if np.linalg.det(corners[1:]) < 0:
        inwards = inwards[:, ::-1]
    np.testing.assert_allclose(closure(corners, inwards), 1.0, atol=1e-4)

    reach = rng.uniform(0.2, 3, 6)
    axes = np.concatenate([np.eye(3), -np.eye(3)]) * reach[:, None]
    faces = [
        [x, z, y] if (x < 3) ^ (y < 4) ^ (z < 5) else [x, y, z]
        for x in (0, 3) for y in (1, 4) for z in (2, 5)
    ]  # fmt: skip
    np.testing.assert_allclose(closure(axes, np.array(faces)), 1.0, atol=1e-4)


def test_facing_away_behind_or_flat_gives_nothing() -> None:
    lower = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    upper = lower[:, ::-1] + UP
    assert triangle_to_triangle(lower, upper)[0] > 0.1
    for receiver, source in (
        (lower[:, ::-1], upper),
        (lower, upper[:, ::-1]),
        (lower, lower),
        (lower, lower + 2),
    ):
        assert triangle_to_triangle(receiver, source)[0] == 0.0
    aside = lower + np.array([3.0, 0, 0])
    assert triangle_to_triangle(lower, aside)[0] == 0.0
    assert triangle_to_triangle(lower, aside[:, ::-1])[0] == 0.0
    flat = np.array([[[0.0, 0, 1], [1, 0, 1], [2, 0, 1]]])
    assert triangle_to_triangle(lower, flat)[0] == 0.0
    assert triangle_to_triangle(flat, lower)[0] == 0.0


def test_faces_in_contact_see_what_they_cover() -> None:
    floor = np.array([[[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]])
    small = np.array([[[0.0, 0.5, 0], [0.5, 0, 0], [0, 0, 0]]])  # looks down, inside the floor
    beside = small - [0.25, 0, 0]  # half the width, three quarters of the area outside
    assert triangle_to_triangle(small, floor)[0] == pytest.approx(1.0, abs=1e-12)
    assert triangle_to_triangle(floor, small)[0] == pytest.approx(0.125 / 2, abs=1e-12)
    assert triangle_to_triangle(beside, floor)[0] == pytest.approx(0.25, abs=1e-12)
    near = small + 1e-5 * UP
    assert triangle_to_triangle(near, floor)[0] == pytest.approx(1.0, abs=1e-3)


def test_parts_behind_the_other_plane_do_not_count() -> None:
    """A wall through a floor: below the floor it neither gives nor takes."""
    floor = np.array([[[0.0, -1, 0], [3, 0, 0], [0, 1, 0]]])
    wall = np.array([[[0.0, -2, -1], [0, 2, -1], [0, 0, 1.5]]])  # looks along +x
    share = 1.5 / 2.5
    above = np.array([[[0.0, -2 * share, 0], [0, 2 * share, 0], [0, 0, 1.5]]])
    expected = triangle_to_triangle(floor, above)[0]
    assert expected > 0.05
    assert triangle_to_triangle(floor, wall)[0] == pytest.approx(expected, abs=1e-5)


def test_tiny_receiver_next_to_a_huge_source() -> None:
    """A thousandth's width from the foot of a wall: what a point there sees."""
    size = 1e-4
    tiny = size * np.array([[[1.0, 0, 0], [2, 0, 0], [1, 1, 0]]]) + [0, 0.3, 0]
    wall = np.array([[[0.0, -1, 0], [0, 2, 0], [0, 0.5, 2.0]]])
    center = tiny.mean(axis=1)
    at_center = point_to_polygon(center, UP[None], wall)[0]
    assert triangle_to_triangle(tiny, wall)[0] == pytest.approx(at_center, abs=1e-5)
    assert triangle_to_triangle(wall, tiny)[0] == pytest.approx(at_center * size**2 / 2 / 3, rel=1e-4)


def test_kronrod_rule_is_exact_to_degree_22_and_its_gauss_rule_to_13() -> None:
    for degree in range(23):
        exact = (1 + (-1) ** degree) / (degree + 1)
        powers = triangle_pairs.KRONROD_NODES**degree
        assert powers @ triangle_pairs.KRONROD_WEIGHTS == pytest.approx(exact, abs=1e-14)
        if degree <= 13:
            assert powers @ triangle_pairs.GAUSS_WEIGHTS == pytest.approx(exact, abs=1e-14)


@pytest.mark.parametrize("width", [1e-6, 1e-8, 1e-10, 1e-13])
@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e4])
def test_needles_send_what_they_have_and_take_no_time(width: float, scale: float) -> None:
    """However thin a needle on a room's floor is, its factors to the other walls add up to 1.

    Outlines of needles cancel to rounding, which no bisection can get below a tolerance.
    """
    room, surface = box_room((1.0, 1.5, 2.0))
    needle = np.array([[0.0, 0.0, 0.0], [0.9, 0.3, 0.0], [0.9, 0.3 + width, 0.0]])
    walls = scale * room[surface != FLOOR]
    needles = np.repeat(scale * needle[None], len(walls), axis=0)
    to_walls, from_walls = triangle_to_triangle(needles, walls), triangle_to_triangle(walls, needles)
    assert to_walls.sum() == pytest.approx(1.0, abs=2e-3)
    area = 0.5 * np.linalg.norm(np.cross(needles[0, 1] - needles[0, 0], needles[0, 2] - needles[0, 0]))
    cross = np.cross(walls[:, 1] - walls[:, 0], walls[:, 2] - walls[:, 0])
    there = 0.5 * np.linalg.norm(cross, axis=1)
    np.testing.assert_allclose(there * from_walls, area * to_walls, rtol=1e-9, atol=0.0)


def test_needles_across_a_plane_see_with_their_part_above_it() -> None:
    """A quarter of the area of a needle that stands point down, half of it below, is above the floor."""
    floor = np.array([[-9e4, -9e4, 0.0], [9e4, -9e4, 0.0], [0.0, 9e4, 0.0]])
    for width in (1e-3, 1e-10):
        needle = np.array([[0.0, 0.0, 1.0], [-width, 0.0, -1.0], [width, 0.0, -1.0]])
        factor = triangle_to_triangle(needle[None], floor[None])[0]
        assert factor == pytest.approx(0.25 * 0.5, rel=0.02)
