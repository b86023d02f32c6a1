"""Digests of textures: detect changed surfaces even if their means over triangles are equal.

Reflectance and opacity must be equal texel by texel. Emission may change its strength: of its pattern a
few random sums are kept, scaled to length 1, whose differences estimate how far two patterns are apart.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence

import numpy as np

from ..numerics import Array, plane_weights_at, signed_double_areas
from .textures import SurfaceImages

LOOKS, GLOWS = (0, 1, 2, 6), (3, 4, 5)
"""Channels of the images: reflectance with opacity, and emission; …"""

PASSES = (7, 8, 9)
"""… and what passes glass."""

SUMS = 8
"""Random sums of each channel of an emission."""

SAME_PATTERN = 1e-4
"""Patterns that differ by no more than this part (RMS) are one: rounding is far below, an edit far above."""

CHUNK = 1 << 20
"""Texels processed at a time."""

_STEPS = 1 << 13
"""Resolution of barycentric weights when a triangle's texels are sorted."""

Glow = Sequence[Sequence[float]]
"""The random sums of each channel, of length 1 or all 0; nothing where emission does not vary."""


def texture_digest(images: SurfaceImages, rows: Array, step: float | None = None) -> str:
    """Return a digest of textured triangles' reflectance and opacity; "" if both are constant.

    It takes every texel, and does not depend on where in the image the triangles lie.

    rows (n,) int: Triangles in their order; those without texture do not count.
    step: Values are rounded to multiples of it; None takes them to the last bit.
    """
    digest, first = hashlib.blake2b(digest_size=16), None
    looks = LOOKS if images.passes is None else (*LOOKS, *PASSES)
    varies = False
    for values, count in _texels(images, rows):
        seen = values[:, looks]
        seen = seen + 0.0 if step is None else np.round(seen / step).astype(np.int16)
        first = seen[0] if first is None else first
        varies = varies or bool((seen != first).any())
        digest.update(count.astype(np.int64).tobytes())
        digest.update(np.ascontiguousarray(seen).tobytes())
    return digest.hexdigest() if varies else ""


def glow_pattern(images: SurfaceImages, rows: Array) -> list[list[float]]:
    """Return a digest of an emission's pattern, independent of its strength; see `Glow`."""
    sums, square = np.zeros((len(GLOWS), SUMS)), np.zeros(len(GLOWS))
    low, high = np.full(len(GLOWS), np.inf), np.full(len(GLOWS), -np.inf)
    chance = np.random.default_rng(0)
    for values, _ in _texels(images, rows):
        seen = values[:, GLOWS].astype(np.float64)
        signs = chance.integers(0, 2, size=(len(seen), SUMS)) * 2.0 - 1.0
        sums += seen.T @ signs
        square += (seen**2).sum(axis=0)
        low, high = np.minimum(low, seen.min(axis=0)), np.maximum(high, seen.max(axis=0))
    if not (high - low > SAME_PATTERN * np.maximum(high, 0.0)).any():
        return []
    length = np.sqrt(square)[:, None]
    scaled = np.where(length > 0.0, sums / np.where(length > 0.0, length, 1.0), 0.0)
    return [[float(value) for value in channel] for channel in scaled]


def same_glow(before: Glow, now: Glow) -> bool:
    """Whether two emissions differ at most in their strength, channel by channel."""
    if not now:
        # A texture may have been dimmed to zero; the triangles' means cover a uniform one.
        return True
    if not before:
        return False
    old, new = np.array(before, dtype=np.float64), np.array(now, dtype=np.float64)
    if old.shape != new.shape or not np.isfinite(old).all():
        return False
    unlit = ~new.any(axis=1)
    apart = np.sqrt(((old - new) ** 2).mean(axis=1))
    return bool((unlit | (apart <= SAME_PATTERN)).all())


def _texels(images: SurfaceImages, rows: Array) -> Iterator[tuple[Array, Array]]:
    """Yield the texels whose centers lie on textured triangles, and how many each triangle has.

    Texels (n, 7), with glass (n, 10).

    Triangles come in groups of one size in texels, and in their order; the texels of each by their weights.
    """
    rows = rows[images.textured[rows]]
    # Whole images are not joined: every object asks for its part of them.
    layers = [images.values] if images.passes is None else [images.values, images.passes]
    height, width = images.values.shape[:2]
    corners = images.image_uv[rows].astype(np.float64) * (width, height) - 0.5
    low = np.rint(np.floor(corners.min(axis=1) + 1e-3)).astype(np.int64)
    size = np.rint(np.ceil(corners.max(axis=1) - 1e-3)).astype(np.int64) - low + 1
    for columns, lines in np.unique(size, axis=0):
        of_this_size = np.flatnonzero((size == (columns, lines)).all(axis=1))
        grid = np.stack(np.meshgrid(np.arange(columns), np.arange(lines)), axis=-1).reshape(-1, 2)
        step = max(CHUNK // max(len(grid), 1), 1)
        for start in range(0, len(of_this_size), step):
            chunk = of_this_size[start : start + step]
            at = low[chunk, None] + grid
            inside, order = _on_triangles(corners[chunk], at)
            column, line = np.clip(at[..., 0], 0, width - 1), np.clip(at[..., 1], 0, height - 1)
            pixel = np.take_along_axis(line * width + column, order, axis=1)
            inside = np.take_along_axis(inside, order, axis=1)
            count = inside.sum(axis=1)
            if count.any():
                wanted = pixel[inside]
                found = [layer.reshape(-1, layer.shape[2])[wanted] for layer in layers]
                yield np.concatenate(found, axis=1), count


def _on_triangles(corners: Array, at: Array) -> tuple[Array, Array]:
    """Return which places (n, k, 2) lie on triangles (n, 3, 2), and their order by the corners' weights."""
    _, second, third = np.moveaxis(plane_weights_at(corners, at), -1, 0)
    hair = 0.25 / _STEPS
    inside = (second >= -hair) & (third >= -hair) & (second + third <= 1.0 + hair)
    # A triangle without area in the image uses its first corner's texel.
    point = signed_double_areas(corners) == 0.0
    nearest = np.abs(at - corners[:, :1]).sum(axis=2).argmin(axis=1)
    inside[point] = np.arange(at.shape[1]) == nearest[point, None]
    second[point[:, None] & np.ones_like(inside)] = 0.0
    third[point[:, None] & np.ones_like(inside)] = 0.0
    key = np.rint(third * _STEPS).astype(np.int64) * (4 * _STEPS) + np.rint(second * _STEPS).astype(np.int64)
    return inside, np.argsort(key, axis=1, kind="stable")
