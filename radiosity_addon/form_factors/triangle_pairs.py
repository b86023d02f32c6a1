"""Form factors between triangles, exact also where they touch, share an edge or cross planes.

Far pairs average the point-to-polygon factor over the smaller triangle by cubature, needles
over points along them. Other near pairs are cut at each other's planes, so that all of one sees
all of the other, and then

    A₁ F₁₂ = 1/(2π) ∮ ∮ ln r dx₁ · dx₂

along both outlines (Stokes' theorem applied twice; Sparrow 1963). The inner integral over a
straight edge is elementary (Mitalas and Stephenson 1966); the outer one goes by Gauss-Kronrod
with bisection, all pairs level by level, only unconverged intervals going on.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..numerics import clip_half_plane, double_area_vectors
from .polygon import CONTACT, IN_PLANE, Float64Array, point_to_polygon

MAX_CUBATURE_RATIO = 0.4
"""Radius of the smaller triangle over its distance to the larger one, below which cubature does."""

TOLERANCE = 2e-5
"""Error allowed to each interval of the outline, as a factor from the smaller triangle."""

BLIND_ERROR = 1e-3
"""Quadrature error between nodes next to an edge, in squares of the interval (measured)."""

BLIND_BISECTIONS = 6
"""Limit of bisections for that reason alone, which would otherwise cut a needle's edges into many parts."""

MAX_BISECTIONS = 24
"""Ends the bisection at singular points; intervals there are below 1e-7 of their edge."""

NEEDLE = 1e-8
"""Outlines around less than this part of their length squared cancel: points are evaluated instead."""

NEEDLE_POINTS = 32

CHUNK_PAIRS = 1 << 14
"""Triangle pairs worked on at a time; temporaries stay below 64 MB."""

_CHUNK_INTERVALS = 1 << 12
"""Outline intervals worked on at a time; some thirty arrays of half a megabyte each."""

# Radon's seven points on a triangle, exact to degree 5, as barycentric weights.
_ROOT15 = np.sqrt(15.0)
_NEAR_CORNER, _NEAR_EDGE = (6.0 - _ROOT15) / 21.0, (6.0 + _ROOT15) / 21.0
_CUBATURE_POINTS = np.concatenate([
    np.full((1, 3), 1.0 / 3.0),
    np.full((3, 3), _NEAR_CORNER) + (1.0 - 3.0 * _NEAR_CORNER) * np.eye(3),
    np.full((3, 3), _NEAR_EDGE) + (1.0 - 3.0 * _NEAR_EDGE) * np.eye(3),
])  # fmt: skip
_CUBATURE_WEIGHTS = np.array([270.0] + 3 * [155.0 - _ROOT15] + 3 * [155.0 + _ROOT15]) / 1200.0

# The 15-point Kronrod rule on (-1, 1) and the 7-point Gauss rule on every second of its nodes
# (Kronrod 1965; figures as in QUADPACK).
_HALF_NODES = np.array([
    0.991455371120812639206854697526329, 0.949107912342758524526189684047851,
    0.864864423359769072789712788640926, 0.741531185599394439863864773280788,
    0.586087235467691130294144691693843, 0.405845151377397166906606412076961,
    0.207784955007898467600689403773245,
])  # fmt: skip
_HALF_KRONROD = np.array([
    0.022935322010529224963732008058970, 0.063092092629978553290700663189204,
    0.104790010322250183839876322541518, 0.140653259715525918745189590510238,
    0.169004726639267902826583426598550, 0.190350578064785409913256402421014,
    0.204432940075298892414161999234649,
])  # fmt: skip
_HALF_GAUSS = np.array([
    0.0, 0.129484966168869693270611432679082, 0.0, 0.279705391489276667901467771423780,
    0.0, 0.381830050505118944950369775488975, 0.0,
])  # fmt: skip
KRONROD_NODES = np.concatenate([-_HALF_NODES, [0.0], _HALF_NODES[::-1]])
KRONROD_WEIGHTS = np.concatenate([_HALF_KRONROD, [0.209482141084727828012999174891714], _HALF_KRONROD[::-1]])
GAUSS_WEIGHTS = np.concatenate([_HALF_GAUSS, [0.417959183673469387755102040816327], _HALF_GAUSS[::-1]])


def triangle_to_triangle(receivers: npt.ArrayLike, sources: npt.ArrayLike) -> Float64Array:
    """Return the form factor F receiver→source between triangles, row by row.

    The fraction of what leaves the receiver's front that lands on the source's front,
    unoccluded; parts that lie behind the other's plane do not count. Reciprocal to rounding,
    A_r F_rs = A_s F_sr. Coplanar triangles give 0, but faces that touch and face each other
    give their overlap over the receiver's area, the limit of a vanishing gap. Triangles
    without area give 0.

    receivers, sources (n, 3, 3): Corners, counter-clockwise from the front.
    Returns factors (n,) float64 in [0, 1]: Within 3e-5 for touching and crossing pairs, 1e-6 for far ones
        (see `MAX_CUBATURE_RATIO`).
    Raises ValueError if shapes do not match.
    """
    receivers, sources = np.asarray(receivers, dtype=np.float64), np.asarray(sources, dtype=np.float64)
    if receivers.ndim != 3 or receivers.shape[1:] != (3, 3) or receivers.shape != sources.shape:
        raise ValueError(f"receivers {receivers.shape} and sources {sources.shape} must both be (n, 3, 3)")
    factors = np.empty(len(receivers))
    for start in range(0, len(receivers), CHUNK_PAIRS):
        rows = slice(start, start + CHUNK_PAIRS)
        factors[rows] = _chunk_factors(receivers[rows], sources[rows])
    return factors


def _chunk_factors(receivers: Float64Array, sources: Float64Array) -> Float64Array:
    """Return (m,) factors; the outer integral always runs over the smaller triangle."""
    normal_r, area_r = _normals(receivers)
    normal_s, area_s = _normals(sources)
    swap = (area_s < area_r)[:, None]
    outer = np.where(swap[..., None], sources, receivers)
    inner = np.where(swap[..., None], receivers, sources)
    outer_normal, inner_normal = np.where(swap, normal_s, normal_r), np.where(swap, normal_r, normal_s)
    outer_area = np.minimum(area_r, area_s)

    center = outer.mean(axis=1)
    apart = np.linalg.norm(inner.mean(axis=1) - center, axis=1)
    outer_radius = _radius(outer, center)
    inner_radius = _radius(inner, inner.mean(axis=1))
    # Distances to the other's plane; corners within rounding of it lie in it.
    noise = IN_PLANE * (apart + outer_radius + inner_radius)[:, None]
    outer_height = _heights(outer, inner[:, 0], inner_normal, noise)
    inner_height = _heights(inner, outer[:, 0], outer_normal, noise)

    solid = outer_area > 0.0
    facing = solid & (outer_height.max(axis=1) > 0.0) & (inner_height.max(axis=1) > 0.0)
    whole = facing & (outer_height.min(axis=1) >= 0.0) & (inner_height.min(axis=1) >= 0.0)
    distance = np.maximum(apart - inner_radius, outer_height.mean(axis=1))
    far = whole & (outer_radius < MAX_CUBATURE_RATIO * distance)
    opposite = np.einsum("ij,ij->i", outer_normal, inner_normal) < CONTACT - 1.0
    touching = solid & opposite & ~outer_height.any(axis=1) & ~inner_height.any(axis=1)

    # A F as a share of the smaller area: the factor from the smaller triangle.
    mutual = np.zeros(len(outer))
    rows = np.flatnonzero(far)
    if len(rows):
        mutual[rows] = _cubature(outer[rows], outer_normal[rows], inner[rows])
    needle = facing & ~far & (outer_area < NEEDLE * outer_radius * (outer_radius + inner_radius))
    rows = np.flatnonzero(needle)
    if len(rows):
        mutual[rows] = _along_needles(outer[rows], outer_normal[rows], inner[rows])
    rows = np.flatnonzero(whole & ~far & ~needle)
    if len(rows):
        mutual[rows] = _outline_factor(outer[rows], inner[rows], outer_area[rows])
    rows = np.flatnonzero(facing & ~whole & ~needle)
    if len(rows):
        outer_part = clip_half_plane(outer[rows], outer_height[rows])
        inner_part = clip_half_plane(inner[rows], inner_height[rows])
        mutual[rows] = _outline_factor(outer_part, inner_part, outer_area[rows])
    rows = np.flatnonzero(touching)
    if len(rows):
        mutual[rows] = _overlap_area(outer[rows], inner[rows], inner_normal[rows]) / outer_area[rows]
    share = np.divide(outer_area, area_r, out=np.zeros_like(area_r), where=area_r > 0.0)
    return np.clip(mutual, 0.0, 1.0) * share


def _normals(triangles: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return unit normals (m, 3), zero where there is no area, and areas (m,)."""
    cross = double_area_vectors(triangles)
    double = np.sqrt(np.einsum("ij,ij->i", cross, cross))
    return cross / np.where(double > 0.0, double, 1.0)[:, None], 0.5 * double


def _radius(triangles: Float64Array, centers: Float64Array) -> Float64Array:
    """Return the distance (m,) from each center to its triangle's farthest corner."""
    arms = triangles - centers[:, None]
    return np.sqrt(np.einsum("ijk,ijk->ij", arms, arms).max(axis=1))


def _heights(
    corners: Float64Array, base: Float64Array, normals: Float64Array, noise: Float64Array
) -> Float64Array:
    """Return (m, k) signed distances of corners (m, k, 3) to planes, with `noise` taken as 0."""
    heights = np.einsum("ijk,ik->ij", corners - base[:, None], normals)
    return np.where(np.abs(heights) <= noise, 0.0, heights)


def _cubature(outer: Float64Array, outer_normal: Float64Array, inner: Float64Array) -> Float64Array:
    """Return the mean point-to-polygon factor over seven points of each outer triangle."""
    count = len(outer)
    points = (_CUBATURE_POINTS @ outer).reshape(-1, 3)
    spread = (count, len(_CUBATURE_WEIGHTS), 3)
    normals = np.broadcast_to(outer_normal[:, None], spread).reshape(-1, 3)
    factors = point_to_polygon(points, normals, np.repeat(inner, spread[1], axis=0))
    return weighted_sums(factors.reshape(count, -1), _CUBATURE_WEIGHTS)


def _along_needles(outer: Float64Array, outer_normal: Float64Array, inner: Float64Array) -> Float64Array:
    """Return the mean point-to-polygon factor over points along the middle of each outer triangle.

    Evenly by area: the width grows from one end of the longest side to the foot of the third corner.
    """
    count, rows = len(outer), np.arange(len(outer))
    sides = np.roll(outer, -1, axis=1) - outer
    longest = np.einsum("ijk,ijk->ij", sides, sides).argmax(axis=1)
    start, side = outer[rows, longest], sides[rows, longest]
    top = outer[rows, (longest + 2) % 3] - start
    foot = np.einsum("ij,ij->i", top, side) / np.einsum("ij,ij->i", side, side)
    foot = np.clip(foot, 1e-9, 1.0 - 1e-9)[:, None]
    share = (np.arange(NEEDLE_POINTS) + 0.5) / NEEDLE_POINTS
    rising = share < foot
    at = np.where(rising, np.sqrt(share * foot), 1.0 - np.sqrt((1.0 - share) * (1.0 - foot)))
    height = np.where(rising, at / foot, (1.0 - at) / (1.0 - foot))
    off = top - foot * side
    points = start[:, None] + at[..., None] * side[:, None] + 0.5 * height[..., None] * off[:, None]
    normals = np.repeat(outer_normal, NEEDLE_POINTS, axis=0)
    factors = point_to_polygon(points.reshape(-1, 3), normals, np.repeat(inner, NEEDLE_POINTS, axis=0))
    return weighted_sums(factors.reshape(count, -1), np.full(NEEDLE_POINTS, 1.0 / NEEDLE_POINTS))


def weighted_sums(values: Float64Array, weights: Float64Array) -> Float64Array:
    """Return (m,) Σ_k values_mk weights_k, the same bits for a row regardless of the other rows.

    A matrix product promises no such thing: it treats the last rows of an array differently,
    and a pair's factor must not depend on the other pairs of the call.
    """
    total: Float64Array = values[:, 0] * weights[0]
    for column in range(1, len(weights)):
        total = total + values[:, column] * weights[column]
    return total


def _overlap_area(polygons: Float64Array, triangles: Float64Array, normals: Float64Array) -> Float64Array:
    """Return the area (m,) that coplanar polygons and triangles with given normals share."""
    for corner in range(3):
        start = triangles[:, corner]
        inward = np.cross(normals, triangles[:, (corner + 1) % 3] - start)
        polygons = clip_half_plane(polygons, np.einsum("ijk,ik->ij", polygons - start[:, None], inward))
    arms = polygons[:, 1:] - polygons[:, :1]
    total = np.cross(arms[:, :-1], arms[:, 1:]).sum(axis=1)
    return 0.5 * np.sqrt(np.einsum("ij,ij->i", total, total))


def _outline_factor(outer: Float64Array, inner: Float64Array, area: Float64Array) -> Float64Array:
    """Return 1/(2πA) ∮ ∮ ln r dx · dy along outlines (m, k, 3) and (m, l, 3) that see each other whole."""
    count, sides = outer.shape[:2]
    scale = 2.0 * np.pi * area
    row = np.repeat(np.arange(count), sides)
    start, edge = outer.reshape(-1, 3), (np.roll(outer, -1, axis=1) - outer).reshape(-1, 3)
    from_t, width = np.zeros(len(row)), 1.0
    total = np.zeros(count)
    for bisection in range(MAX_BISECTIONS + 1):
        value, error = np.empty(len(row)), np.empty(len(row))
        for begin in range(0, len(row), _CHUNK_INTERVALS):
            part = slice(begin, begin + _CHUNK_INTERVALS)
            nodes = from_t[part, None] + 0.5 * width * (1.0 + KRONROD_NODES)
            along = start[part, None] + nodes[..., None] * edge[part, None]
            height = _edge_integrals(along, edge[part], inner[row[part]])
            value[part] = 0.5 * width * weighted_sums(height, KRONROD_WEIGHTS)
            error[part] = np.abs(value[part] - 0.5 * width * weighted_sums(height, GAUSS_WEIGHTS))
            if bisection < BLIND_BISECTIONS:
                middle = start[part] + (from_t[part, None] + 0.5 * width) * edge[part]
                square = width * width * np.einsum("ij,ij->i", edge[part], edge[part])
                near = _square_distances(middle, inner[row[part]]) < square
                error[part] = np.maximum(error[part], np.where(near, BLIND_ERROR * square, 0.0))
        again = error > TOLERANCE * scale[row]
        if bisection == MAX_BISECTIONS:
            again[:] = False
        total += np.bincount(row[~again], weights=value[~again], minlength=count)
        row, start, edge, from_t = (np.repeat(rows[again], 2, axis=0) for rows in (row, start, edge, from_t))
        if not len(row):
            break
        width *= 0.5
        from_t[1::2] += width
    return total / scale


def _square_distances(points: Float64Array, polygons: Float64Array) -> Float64Array:
    """Return (m,) squared distances from points (m, 3) to the outlines of polygons (m, k, 3)."""
    start = polygons - points[:, None]
    edge = np.roll(start, -1, axis=1) - start
    square = np.einsum("ijk,ijk->ij", edge, edge)
    foot = -np.einsum("ijk,ijk->ij", start, edge) / np.where(square > 0.0, square, 1.0)
    nearest = start + np.clip(foot, 0.0, 1.0)[..., None] * edge
    return np.einsum("ijk,ijk->ij", nearest, nearest).min(axis=1)


def _edge_integrals(points: Float64Array, direction: Float64Array, polygons: Float64Array) -> Float64Array:
    """Return Σ over edges of (d · ê) ∫ ln r ds, seen from points (m, g, 3) with their edge's d (m, 3).

    With a, b from the point to the edge's ends, ê its direction, h the distance to its line
    and γ the angle it spans: ∫ ln r ds = (b·ê) ln|b| − (a·ê) ln|a| + hγ − length; the lengths
    drop out around a closed outline.
    """
    total = np.zeros(points.shape[:2])
    px, py, pz = (np.ascontiguousarray(points[..., axis]) for axis in range(3))
    ends = [[polygons[:, corner, axis, None] for axis in range(3)] for corner in range(polygons.shape[1])]
    ax, ay, az = _offsets(ends[-1], px, py, pz)
    log_a = _half_log(ax * ax + ay * ay + az * az)
    for corner, end in enumerate(ends):
        side = polygons[:, corner] - polygons[:, corner - 1]
        length = np.sqrt(np.einsum("ij,ij->i", side, side))
        unit = side / np.where(length > 0.0, length, 1.0)[:, None]
        ex, ey, ez = (unit[:, axis, None] for axis in range(3))
        bx, by, bz = _offsets(end, px, py, pz)
        log_b = _half_log(bx * bx + by * by + bz * bz)
        cx, cy, cz = ay * ez - az * ey, az * ex - ax * ez, ax * ey - ay * ex
        away = np.sqrt(cx * cx + cy * cy + cz * cz)
        angle = np.arctan2(away * length[:, None], ax * bx + ay * by + az * bz)
        along_a, along_b = ax * ex + ay * ey + az * ez, bx * ex + by * ey + bz * ez
        integral = along_b * log_b - along_a * log_a + away * angle
        total += np.einsum("ij,ij->i", direction, unit)[:, None] * integral
        ax, ay, az, log_a = bx, by, bz, log_b
    return total


def _offsets(end: list[Float64Array], *points: Float64Array) -> list[Float64Array]:
    """Return the coordinates of `end` as seen from points, each an array of its own."""
    return [np.subtract(coordinate, point) for coordinate, point in zip(end, points, strict=True)]


def _half_log(square: Float64Array) -> Float64Array:
    """Return ln r of r², with a finite stand-in at r = 0, where ln r is multiplied by 0."""
    return 0.5 * np.log(np.maximum(square, np.finfo(float).tiny))
