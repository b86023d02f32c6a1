"""A ray tracer of its own for tests of energy: every ray against every triangle, in float64.

It shares no code with the program. It knows which of several surfaces in one place counts from the rule in
docs/decisions/0045 alone, applied point by point.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

PARALLEL = 0.9998
CHUNK = 2_000
TIE = 1e-8
"""Faces so close are in one plane [m]."""

LEAST = 8
"""Points of every side."""


@dataclass(frozen=True)
class Soup:
    """Two-sided triangles of one channel.

    Attributes
    ----------
    triangles : (t, 3, 3) float64
    reflectance, emission : (t,) float64
        Emission is the exitance [W/m²] of either side.
    """

    triangles: np.ndarray
    reflectance: np.ndarray
    emission: np.ndarray

    @property
    def normals(self) -> np.ndarray:
        cross = np.cross(*self._edges)
        return np.asarray(cross / np.linalg.norm(cross, axis=1, keepdims=True))

    @property
    def areas(self) -> np.ndarray:
        return np.asarray(0.5 * np.linalg.norm(np.cross(*self._edges), axis=1))

    @property
    def _edges(self) -> tuple[np.ndarray, np.ndarray]:
        return self.triangles[:, 1] - self.triangles[:, 0], self.triangles[:, 2] - self.triangles[:, 0]


@dataclass(frozen=True)
class Balance:
    """Powers [W], and the standard error of emitted − absorbed − escaped."""

    emitted: float
    absorbed: float
    escaped: float
    error: float

    @property
    def excess(self) -> float:
        """What arrives beyond what was emitted, as a share of it."""
        return (self.absorbed + self.escaped) / self.emitted - 1.0


def measure(
    soup: Soup,
    irradiance: Callable[[np.ndarray, np.ndarray], np.ndarray],
    layer: float,
    count: int = 4000,
    rays: int = 64,
    seed: int = 1,
) -> Balance:
    """Follow the light of a solved soup.

    Parameters
    ----------
    irradiance : callable
        (points, normals) → (n,) what the program says arrives there [W/m²].
    layer : float
        Faces no farther apart are in one place [m].
    """
    rng = np.random.default_rng(seed)
    areas = np.repeat(soup.areas, 2)
    each = np.maximum(np.ceil(count * areas / areas.sum()), LEAST).astype(int)
    side = np.repeat(np.arange(len(areas)), each)
    triangle, sign = side // 2, np.where(side % 2 == 0, 1.0, -1.0)
    u, v = np.sort(_lattice(each, rng), axis=0)
    a, b, c = soup.triangles[triangle].transpose(1, 0, 2)
    points = a + u[:, None] * (b - a) + (v - u)[:, None] * (c - a)
    normals = sign[:, None] * soup.normals[triangle]
    seen = np.flatnonzero(~covered(soup, triangle, points, normals, layer))
    values = np.zeros((3, len(side)))
    arriving = irradiance(points[seen], normals[seen])
    emission, reflectance = soup.emission[triangle[seen]], soup.reflectance[triangle[seen]]
    sent = emission + reflectance * arriving
    lost = sent * escape_share(soup, points[seen], normals[seen], layer, rays, rng)
    # Points that are covered count 0, in all three.
    values[:, seen] = emission, (1.0 - reflectance) * arriving, lost
    power = (values * (areas / each)[side]).sum(axis=1)
    excess = values[1] + values[2] - values[0]
    mean = np.bincount(side, excess) / each
    variance = np.bincount(side, (excess - mean[side]) ** 2) / (each - 1)
    return Balance(*power.tolist(), float(np.sqrt((areas**2 * variance / each).sum())))


def _lattice(each: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return (2, Σ each) numbers in [0, 1): for each side points that fill the square evenly."""
    golden = np.array([0.7548776662466927, 0.5698402909980532])
    number = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
    shift = np.repeat(rng.random((len(each), 2)), each, axis=0)
    return np.asarray((shift + number[:, None] * golden).T % 1.0)


def covered(
    soup: Soup, triangle: np.ndarray, points: np.ndarray, normals: np.ndarray, layer: float
) -> np.ndarray:
    """Return (n,) whether another side in the same place, facing the same way, counts there."""
    result = np.zeros(len(points), dtype=bool)
    number = np.arange(len(soup.triangles))
    emits = soup.emission > 0
    for start in range(0, len(points), CHUNK):
        rows = slice(start, start + CHUNK)
        place, at, own = points[rows], normals[rows], triangle[rows]
        parallel = at @ soup.normals.T
        parallel = np.where(np.abs(parallel) > PARALLEL, parallel, np.inf)
        # Where the normal through the point meets each triangle's plane.
        reach = np.einsum("ntk,tk->nt", soup.triangles[None, :, 0] - place[:, None], soup.normals) / parallel
        near = np.isfinite(parallel) & (np.abs(reach) <= layer)
        near &= _inside(soup, place[:, None] + reach[..., None] * at[:, None]) & (number != own[:, None])
        tie = np.abs(reach) <= TIE
        before = np.where(emits != emits[own][:, None], emits, number < own[:, None])
        result[rows] = (near & np.where(tie, before, reach > 0)).any(axis=1)
    return result


def _inside(soup: Soup, points: np.ndarray) -> np.ndarray:
    """Return (n, t) whether points (n, t, 3) in the triangles' planes are in them."""
    inside = np.ones(points.shape[:2], dtype=bool)
    for corner in range(3):
        start, end = soup.triangles[:, corner], soup.triangles[:, (corner + 1) % 3]
        turn = np.cross(end - start, points - start)
        inside &= np.einsum("ntk,tk->nt", turn, soup.normals) >= 0
    return inside


def escape_share(
    soup: Soup,
    points: np.ndarray,
    normals: np.ndarray,
    layer: float,
    rays: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return (n,) what share of the light of points leaves the soup."""
    share = np.empty(len(points))
    helper = np.where(np.abs(normals[:, :1]) > 0.5, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    one = np.cross(helper, normals)
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    other = np.cross(normals, one)
    step = max(400_000 // (rays * len(soup.triangles)), 1)
    for start in range(0, len(points), step):
        rows = slice(start, start + step)
        place, at = points[rows], normals[rows]
        turn = 2.0 * np.pi * rng.random((len(place), rays))
        sine2 = (np.arange(rays) + rng.random((len(place), rays))) / rays
        across = np.sqrt(sine2)
        way = (across * np.cos(turn))[..., None] * one[rows, None]
        way += (across * np.sin(turn))[..., None] * other[rows, None]
        way += np.sqrt(1.0 - sine2)[..., None] * at[:, None]
        share[rows] = ~_stopped(soup, place, at, way, layer) @ np.full(rays, 1.0 / rays)
    return share


def _stopped(soup: Soup, place: np.ndarray, normals: np.ndarray, way: np.ndarray, layer: float) -> np.ndarray:
    """Return (n, r) whether rays from points meet anything but what lies in the place they start from."""
    height = np.einsum("ntk,tk->nt", soup.triangles[None, :, 0] - place[:, None], soup.normals)
    own = (np.abs(normals @ soup.normals.T) > PARALLEL) & (np.abs(height) <= layer)
    along = np.einsum("nrk,tk->nrt", way, soup.normals)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = height[:, None] / along
    # Cramer's rule with the edges' cross products: which side of each edge the ray passes.
    met = (distance > 0) & ~own[:, None]
    for corner in range(3):
        start = soup.triangles[None, :, corner] - place[:, None]
        end = soup.triangles[None, :, (corner + 1) % 3] - place[:, None]
        turn = np.einsum("nrk,ntk->nrt", way, np.cross(start, end))
        met &= np.where(along > 0, turn, -turn) >= 0
    return np.asarray(met.any(axis=2))
