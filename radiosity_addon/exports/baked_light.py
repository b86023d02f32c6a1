"""Images of the light that surfaces send out, with 8 bits a color: dark surfaces read ones of darker white.

What rounding to sRGB costs grows with white: the squared error of a texel is about white^(5/6) · value^(7/6).
A lamp would hide the errors of other surfaces in a sum of these, so each counts in proportion to its value.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..numerics import Array, run_chunks, run_numbers
from .accessors import floats_of, indices_of
from .glb import Glb, Json
from .lit_gltf import LIGHTMAP_CHANNEL, ExportedNames

CHUNK = 1 << 19
"""Cells looked at together: about 60 MB."""

MOST_IMAGES = 4
"""Of a page."""

WORTH = 0.9
"""A further image must bring the error to this part or below."""

BINS = 64
"""Surfaces are sorted by their brightest texel into so many bins, a quarter of a stop each."""

DARKEST = 1e-6
"""White is no darker."""

GAMMA = 2.0 / 2.4
"""See above."""

IN_PROPORTION = 1.5
"""Between 0, where errors count as they are, and 2, where they count in proportion to the surface's value."""

TRIANGLES = 4
"""The mode of primitives that are surfaces."""

Primitive = tuple[int, int]
"""Numbers of a mesh, and of a primitive in it."""


@dataclass(frozen=True, eq=False)
class EmissionImage:
    """Light of a page (height, width, 3) as parts of white, black where no surface reads this image."""

    page: int
    white: float
    colors: Array


class _Surface(NamedTuple):
    """A primitive, and its triangles in UVs (t, 3, 2), v up; None if they cannot be read."""

    key: Primitive
    uv: Array | None


def emission_images(
    written: Glb, names: ExportedNames, pages: Mapping[int, Array], factors: Mapping[int, int]
) -> tuple[list[EmissionImage], dict[Primitive, int]]:
    """Return images of pages, and which of them each primitive that shows a page reads.

    pages: Radiance (height, width, 3), row 0 at v = 0.
    factors: Of each page, how many texels of it are side by side in one of the lightmap's.
    """
    surfaces: dict[int, list[_Surface]] = {number: [] for number in pages}
    for row, mesh in enumerate(written.json.get("meshes", ())):
        for place, primitive in enumerate(mesh["primitives"]):
            material = written.json["materials"][primitive["material"]] if "material" in primitive else {}
            _, page = names.materials.get(material.get("name", ""), ("", None))
            if page in surfaces:
                surfaces[page].append(_Surface((row, place), _triangles(written, primitive)))
    images: list[EmissionImage] = []
    read_by: dict[Primitive, int] = {}
    for number, radiance in pages.items():
        found, image = _of_page(number, surfaces[number], radiance, factors[number])
        keys = [surface.key for surface in surfaces[number]]
        read_by |= zip(keys, (len(images) + image).tolist(), strict=True)
        images += found
    return images, read_by


def _of_page(
    number: int, surfaces: list[_Surface], radiance: Array, factor: int
) -> tuple[list[EmissionImage], Array]:
    """Return the images of a page, and which of them each surface reads (s,)."""
    height, width = radiance.shape[:2]
    shape = height // factor, width // factor
    inside = radiance.reshape(shape[0], factor, shape[1], factor, 3)
    brightest = inside.max(axis=(1, 3, 4)).ravel()
    value = np.maximum(inside, 0.0).mean(axis=(1, 3, 4)).ravel()
    surface, cell = _cells(surfaces, shape, 1.0 / factor)
    own = np.full(len(surfaces), DARKEST)
    np.maximum.at(own, surface, brightest[cell])
    error, mean = (
        np.bincount(surface, part[cell], len(surfaces)) for part in (value ** (2.0 - GAMMA), value)
    )
    area = np.bincount(surface, minlength=len(surfaces))
    whites = _whites(own, error * (area / np.maximum(mean, DARKEST * area)) ** IN_PROPORTION)
    image = np.searchsorted(whites, own)
    images = []
    for row, white in enumerate(whites.tolist()):
        mask = np.zeros(shape[0] * shape[1], dtype=radiance.dtype)
        mask[cell[image[surface] == row]] = 1.0 / white
        scaled = inside * mask.reshape(shape[0], 1, shape[1], 1, 1)
        images.append(EmissionImage(number, white, scaled.reshape(radiance.shape)))
    return images, image


def _whites(brightest: Array, weight: Array) -> Array:
    """Return for which radiances of white (w,), rising, the error of all surfaces (s,) is least.

    weight: What the error of each surface counts, squared, in an image whose white is 1.
    """
    if not len(brightest):
        return np.zeros(0)
    stops = np.minimum(np.floor(4.0 * np.log2(brightest.max() / brightest)), BINS - 1).astype(np.int64)
    bins, place = np.unique(-stops, return_inverse=True)
    white = np.zeros(len(bins))
    np.maximum.at(white, place, brightest)
    total = np.concatenate([[0.0], np.cumsum(np.bincount(place, weight, len(bins)))])
    # costs[a, b]: of the bins from a to b in one image.
    costs = np.where(
        np.tri(len(bins)).T > 0, white[None, :] ** GAMMA * (total[None, 1:] - total[:-1, None]), np.inf
    )
    least, first = costs[0], [np.zeros(len(bins), dtype=np.int64)]
    for _ in range(1, MOST_IMAGES):
        before = np.concatenate([[np.inf], least[:-1]])
        joined = before[:, None] + costs
        if joined[:, -1].min() > WORTH**2 * least[-1]:
            break
        first.append(joined.argmin(axis=0))
        least = joined.min(axis=0)
    last, chosen = len(bins) - 1, []
    for begins in reversed(first):
        chosen.append(last)
        last = int(begins[last]) - 1
    return white[chosen[::-1]]


def _cells(surfaces: list[_Surface], shape: tuple[int, int], reach: float) -> tuple[Array, Array]:
    """Return which surfaces reach which cells of a page (p,), (p,), each pair once, by surface.

    reach: How far from a point on a surface filters read, in cells.
    """
    height, width = shape
    found = []
    for number, surface in enumerate(surfaces):
        if surface.uv is None:
            found.append(number * height * width + np.arange(height * width))
            continue
        triangles = np.clip(surface.uv, 0.0, 1.0) * (width, height)
        first = np.clip(np.floor(triangles[..., 1].min(axis=1) - reach), 0, height - 1).astype(np.int64)
        last = np.clip(np.floor(triangles[..., 1].max(axis=1) + reach), 0, height - 1).astype(np.int64)
        for rows in run_chunks(last - first + 1, CHUNK):
            count = last[rows] - first[rows] + 1
            row = run_numbers(count, first[rows])
            low, high = _span(triangles[rows].repeat(count, axis=0), row - reach, row + 1 + reach)
            begin = np.clip(np.floor(low - reach), 0, width - 1).astype(np.int64)
            end = np.clip(np.floor(high + reach), 0, width - 1).astype(np.int64)
            for part in run_chunks(end - begin + 1, CHUNK):
                across = end[part] - begin[part] + 1
                cell = row[part].repeat(across) * width + run_numbers(across, begin[part])
                found.append(np.unique(number * height * width + cell))
    key = np.unique(np.concatenate(found)) if found else np.zeros(0, dtype=np.int64)
    return key // (height * width), key % (height * width)


def _span(triangles: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Return from where to where triangles (n, 3, 2) reach along x between y = low and y = high (n,)."""
    start, end = triangles, np.roll(triangles, -1, axis=1)
    slope = end[..., 1] - start[..., 1]
    level = slope == 0.0
    sides = [
        np.where(level, side, (y[:, None] - start[..., 1]) / np.where(level, 1.0, slope))
        for y, side in ((low, 0.0), (high, 1.0))
    ]
    begin, stop = np.minimum(*sides), np.maximum(*sides)
    above = (start[..., 1] < low[:, None]) | (start[..., 1] > high[:, None])
    outside = np.where(level, above, (begin > 1.0) | (stop < 0.0))
    along = end[..., 0] - start[..., 0]
    ends = [start[..., 0] + np.clip(at, 0.0, 1.0) * along for at in (begin, stop)]
    return (
        np.where(outside, np.inf, np.minimum(*ends)).min(axis=1),
        np.where(outside, -np.inf, np.maximum(*ends)).max(axis=1),
    )


def _triangles(glb: Glb, primitive: Json) -> Array | None:
    uv = floats_of(glb, primitive["attributes"].get(f"TEXCOORD_{LIGHTMAP_CHANNEL}"), 2)
    if uv is None or primitive.get("mode", TRIANGLES) != TRIANGLES:
        return None
    corner = np.arange(len(uv)) if "indices" not in primitive else indices_of(glb, primitive["indices"])
    if corner is None:
        return None
    uv[:, 1] = 1.0 - uv[:, 1]
    return uv[corner[: len(corner) // 3 * 3].reshape(-1, 3)]
