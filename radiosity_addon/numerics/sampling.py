"""Samples: low-discrepancy points, and maps that carry them onto shapes.

Counter-based: a point depends on its row's key, its own index and the seed alone, never on
what was drawn before, so neither chunks nor threads change a result.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.floating[Any]]

_TABLE_BITS = 16
"""Points of a row's sequence that are shuffled among themselves, as a power of two."""


def hash_keys(keys: npt.ArrayLike, seed: int = 0) -> npt.NDArray[np.uint32]:
    """Mix integers into 32 well-scattered bits each.

    An avalanche of xor-shifts and odd multiplications, applied to the low word, then to the
    high word and the seed, so that keys above 2³² and neighboring seeds stay apart.

    keys (...,) non-negative integers.
    Returns bits (...,) uint32.
    """
    wide = np.asarray(keys).astype(np.uint64)
    low = (wide & np.uint64(0xFFFFFFFF)).astype(np.uint32)
    high = (wide >> np.uint64(32)).astype(np.uint32)
    salt = np.array([seed & 0xFFFFFFFF, (seed >> 32) & 0xFFFFFFFF], dtype=np.uint32)
    salt = _avalanche(salt[:1] ^ _avalanche(salt[1:] + np.uint32(1)))
    return _avalanche(low ^ _avalanche((high + np.uint32(0x9E3779B9)) ^ salt))


def _avalanche(bits: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Return a bijection of uint32 in which every input bit flips about half the output bits."""
    bits = bits ^ (bits >> np.uint32(16))
    bits *= np.uint32(0x7FEB352D)
    bits ^= bits >> np.uint32(15)
    bits *= np.uint32(0x846CA68B)
    bits ^= bits >> np.uint32(16)
    return bits


def stratified_square(
    keys: npt.ArrayLike, k: int, seed: int = 0, first: npt.ArrayLike = 0
) -> npt.NDArray[np.float32]:
    """Return k low-discrepancy points in the unit square for every key.

    The first two Sobol' dimensions, a (0,2)-sequence in base 2, shuffled and shifted by the
    row's own random bits. Every aligned run of 2^m points (from `first` = 0, or a multiple of
    2^m) has one point in each elementary box of area 2^-m, and each point alone is uniform.
    The shuffle moves aligned runs as wholes (Burley 2020, "Practical hash-based Owen
    scrambling"), so squares of different seeds may be joined to more dimensions. Asking on
    with `first` = k continues the same row's sequence.

    keys (n,) non-negative integers: What each row is for, a texel's number, say. Equal keys get equal points.
    k: Points a row; powers of two stratify best.
    first: Index of the first point, of all rows or (n,) of each.
    Returns u (n, k, 2) float32 in [0, 1).
    """
    rows = np.asarray(keys)
    index = np.asarray(first, dtype=np.uint32)[..., None] + np.arange(k, dtype=np.uint32)
    low = index & np.uint32((1 << _TABLE_BITS) - 1)
    high = index - low
    order = _shuffle(_reversals()[low], hash_keys(rows, 3 * seed)[:, None])
    # Both dimensions at once, as one number of 64 bits.
    bits = _reversed_table().view(np.uint64)[:, 0].take(order).view(np.uint32).reshape(*order.shape, 2)
    if high.any():
        bits ^= _sobol_bits(high)
    bits ^= np.stack([hash_keys(rows, 3 * seed + 1), hash_keys(rows, 3 * seed + 2)], axis=-1)[:, None]
    # 24 bits are what a float32 below 1 holds exactly; rounding 32 could give 1.
    bits >>= np.uint32(8)
    square = bits.astype(np.float32)
    square *= np.float32(2.0**-24)
    return square


def _shuffle(reversed_index: npt.NDArray[np.uint32], salt: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Permute bit-reversed indices so that each bit flips by a hash of the bits below it only.

    Multiplying by an even number carries upward alone (Laine and Karras 2011): in plain
    order, halves swap within halves, as in Owen's scrambling.
    """
    bits = reversed_index + salt
    for factor in (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6):
        bits ^= bits * np.uint32(factor)
    bits &= np.uint32((1 << _TABLE_BITS) - 1)
    return bits


def _reversed_bits(index: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Return the low `_TABLE_BITS` bits of each index in opposite order."""
    reverse = np.zeros_like(index)
    for digit in range(_TABLE_BITS):
        reverse |= ((index >> np.uint32(digit)) & np.uint32(1)) << np.uint32(_TABLE_BITS - 1 - digit)
    return reverse


@cache
def _reversals() -> npt.NDArray[np.uint32]:
    """Return `_reversed_bits` of all (2^`_TABLE_BITS`,) indices."""
    return _reversed_bits(np.arange(1 << _TABLE_BITS, dtype=np.uint32))


@cache
def _reversed_table() -> npt.NDArray[np.uint32]:
    """Return the Sobol' points by bit-reversed index, (2^`_TABLE_BITS`, 2)."""
    return _sobol_bits(_reversals())


def _sobol_bits(index: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Return the first two Sobol' dimensions of points `index` (…, k) as (…, k, 2) binary fractions."""
    bits = np.zeros((*index.shape, 2), dtype=np.uint32)
    radical, pascal = 1 << 31, 1 << 31
    for digit in range(32):
        on = ((index >> np.uint32(digit)) & np.uint32(1)).astype(bool)
        bits[on, 0] ^= np.uint32(radical)
        bits[on, 1] ^= np.uint32(pascal)
        radical >>= 1
        pascal ^= pascal >> 1
    return bits


def points_on_triangles(triangles: FloatArray, u: FloatArray) -> FloatArray:
    """Carry points of the unit square onto triangles, keeping them uniform.

    The square is folded onto the triangle along its diagonal (Heitz 2019, "A low-distortion
    map between triangle and square"), which keeps strata compact.

    triangles (n, 3, 3).
    u (n, k, 2) or (k, 2) float in [0, 1].
    Returns points (n, k, 3).
    """
    # In float64: weights that sum to 1 up to float32 only would lift points off a far plane.
    unit = np.asarray(u, dtype=np.float64)
    smaller = 0.5 * np.minimum(unit[..., 0], unit[..., 1])
    first = unit[..., 0] - smaller
    second = unit[..., 1] - smaller
    weights = np.stack([1.0 - first - second, first, second], axis=-1)
    return weights @ triangles


def point_on_each_triangle(triangles: FloatArray, u: FloatArray) -> FloatArray:
    """Carry a point of the unit square, (..., 2), onto each of (..., 3, 3) triangles: (..., 3) float64."""
    points = points_on_triangles(triangles.reshape(-1, 3, 3), u.reshape(-1, 1, 2))
    return points.reshape(*triangles.shape[:-2], 3)


def directions_to_triangles(triangles: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Carry points of the unit square to directions in which triangles are seen, uniform in solid angle.

    Arvo, Stratified sampling of spherical triangles (1995). The angles' sum is as good as rounding lets it be
    for triangles that look large.

    triangles (n, 3, 3): Corners, relative to where they are seen from.
    u (n, 2) float in [0, 1].
    Returns directions (n, 3), unit, and solid angles (n,) [sr].
    """
    unit = np.asarray(u, dtype=np.float64)
    a, b, c = _unit(triangles).transpose(1, 0, 2)
    plane_ab, plane_bc, plane_ac = (_unit(np.cross(*pair)) for pair in ((a, b), (b, c), (a, c)))
    alpha = _angle(plane_ab, plane_ac)
    angles = alpha + _angle(-plane_ab, plane_bc) + _angle(plane_ac, plane_bc)
    solid_angle = np.maximum(angles - np.pi, 0.0)
    # An arc from b to a place on the side from a to c cuts off the first part.
    sine, cosine = np.sin(unit[:, 0] * solid_angle - alpha), np.cos(unit[:, 0] * solid_angle - alpha)
    x, y = cosine - np.cos(alpha), sine + np.sin(alpha) * _dot(a, b)
    divisor = (y * sine + x * cosine) * np.sin(alpha)
    height = ((y * cosine - x * sine) * np.cos(alpha) - y) / np.where(divisor == 0.0, 1.0, divisor)
    place = _between(a, c, np.where(divisor == 0.0, 1.0, height))
    return _between(b, place, 1.0 - unit[:, 1] * (1.0 - _dot(place, b))), solid_angle


def _between(pole: FloatArray, toward: FloatArray, height: FloatArray) -> FloatArray:
    """Return (n, 3) directions of cosine `height` (n,) to a pole, turned from it toward others."""
    height = np.clip(height, -1.0, 1.0)[:, None]
    aside = _unit(toward - _dot(toward, pole)[:, None] * pole)
    return np.asarray(height * pole + np.sqrt(1.0 - height**2) * aside)


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-300))


def _dot(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nk,nk->n", one, other))


def _angle(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return (n,) the angles between unit vectors."""
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), _dot(one, other)))


def concentric_disk(u: FloatArray) -> FloatArray:
    """Carry points of the unit square onto the unit disk, keeping them uniform.

    Concentric squares become concentric circles (Shirley and Chiu 1997), so neighbors stay
    neighbors.

    u (..., 2) float in [0, 1].
    Returns points (..., 2).
    """
    x, y = 2.0 * u[..., 0] - 1.0, 2.0 * u[..., 1] - 1.0
    wide = np.abs(x) > np.abs(y)
    radius = np.where(wide, x, y)
    ratio = np.where(wide, y, x) / np.where(radius == 0.0, 1.0, radius)
    angle = np.where(wide, (np.pi / 4) * ratio, np.pi / 2 - (np.pi / 4) * ratio)
    points: FloatArray = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    return points.astype(u.dtype, copy=False)


def cosine_hemisphere(u: FloatArray) -> FloatArray:
    """Carry points of the unit square to directions with density cosθ/π about +z.

    u (..., 2) float in [0, 1].
    Returns directions (..., 3), unit, z ≥ 0.
    """
    disk = concentric_disk(u)
    height = np.sqrt(np.maximum(1.0 - disk[..., 0] ** 2 - disk[..., 1] ** 2, 0.0))
    return np.concatenate([disk, height[..., None]], axis=-1)


def uniform_cone(u: FloatArray, one_minus_cosine: FloatArray | float) -> FloatArray:
    """Carry points of the unit square to directions uniform in solid angle in a cone about +z.

    u (..., 2) float in [0, 1].
    one_minus_cosine float or (...,) float: 1 − cos of the cone's half angle; given so because it stays exact
        in narrow cones.
    Returns directions (..., 3), unit.
    """
    disk = concentric_disk(u)
    share = disk[..., 0] ** 2 + disk[..., 1] ** 2
    drop = share * one_minus_cosine
    # On the cap sin²θ = drop (2 − drop); the disk's direction only gives the azimuth.
    stretch = np.sqrt(one_minus_cosine * (2.0 - drop))
    return np.stack([disk[..., 0] * stretch, disk[..., 1] * stretch, 1.0 - drop], axis=-1)


def orthonormal_basis(normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two tangents that make a right-handed frame with each unit normal.

    Without a branch or a singular direction (Duff et al. 2017).

    normals (..., 3), unit.
    Returns tangent, bitangent (..., 3), unit; tangent × bitangent = normal.
    """
    x, y, z = normals[..., 0], normals[..., 1], normals[..., 2]
    sign = np.copysign(1.0, z).astype(normals.dtype, copy=False)
    a = -1.0 / (sign + z)
    b = x * y * a
    tangent = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    bitangent = np.stack([b, sign + y * y * a, -y], axis=-1)
    return tangent, bitangent


def to_world(local: FloatArray, normals: FloatArray) -> FloatArray:
    """Turn directions given about +z into world space about each row's normal.

    local (n, k, 3).
    normals (n, 3), unit.
    Returns directions (n, k, 3).
    """
    tangent, bitangent = orthonormal_basis(normals)
    return local @ np.stack([tangent, bitangent, normals], axis=-2)
