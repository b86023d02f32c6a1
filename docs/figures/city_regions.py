"""A city in regions, on paper: how much each must know of the others, and in how many rounds they agree."""

from __future__ import annotations

import json
from pathlib import Path

import drawing
import numpy as np
from matplotlib.figure import Figure

ROOMS = Path(__file__).resolve().parents[2] / "bench" / "results" / "rooms.json"

TRIANGLES = 1e8
ACROSS = 10
"""Regions along each side of the city."""

SURFACE = 4.0
"""Area of all surfaces above a piece of ground, in its own area: ground, roofs, façades."""

HALO = 0.1
"""Width around a region in which it knows every triangle, in its own width."""

APPARENT = 0.1
"""Size of a cluster over its distance, at most."""

NUMBERS = 12
"""Bytes of a radiosity: three numbers in single precision."""


def clusters(reach: float, apparent: float = APPARENT, halo: float = HALO) -> float:
    """Return how many clusters a region sees, if the city reaches so far around it, in its own widths.

    At distance x there are (4 + 2πx) dx of ground around a unit square, and clusters of area (apparent x)².
    """
    return SURFACE / apparent**2 * (4 * (1 / halo - 1 / reach) + 2 * np.pi * np.log(reach / halo))


def counted(reach: float, rng: np.random.Generator, count: int) -> float:
    """Return the same from points scattered around the square."""
    width = 1 + 2 * reach
    place = rng.uniform(-reach, 1 + reach, (count, 2))
    distance = np.linalg.norm(place - place.clip(0, 1), axis=1)
    seen = (distance > HALO) & (distance < reach)
    return SURFACE / APPARENT**2 * width**2 * float(np.sum(distance[seen] ** -2.0)) / count


def factor(reflectance: float, others: float, sky: float = 0.0) -> float:
    """Return by how much a round shrinks the error at least, if `others` is what others fill of the view."""
    return reflectance * others / (1 - reflectance * (1 - others - sky))


def rounds(reflectance: float, others: float, error: float = 1e-4) -> int:
    """Return how many rounds are enough."""
    return int(np.ceil(np.log(error) / np.log(factor(reflectance, others))))


def observed(reflectance: float, regions: int, rng: np.random.Generator) -> tuple[float, float]:
    """Return by how much a round shrinks the error of a random city in a row, and the bound."""
    n = 40 * regions
    at = np.sort(rng.uniform(0, regions, n))
    view = rng.exponential(size=(n, n)) / (0.05 + np.abs(at[:, None] - at)) ** 2
    np.fill_diagonal(view, 0.0)
    view /= view.sum(axis=1, keepdims=True)
    own = np.floor(at)[:, None] == np.floor(at)
    inner, outer = reflectance * view * own, reflectance * view * ~own
    step = np.linalg.solve(np.eye(n) - inner, outer)
    seen = (view * ~own).sum(axis=1)
    return float(np.abs(np.linalg.eigvals(step)).max()), max(factor(reflectance, each) for each in seen)


def center_error(apparent: float) -> float:
    """Return how wrong light of a square is that is taken to come from its center, over tilts of both sides.

    Relative to the square facing the receiver.
    """
    side = (np.arange(40) + 0.5) / 40 - 0.5
    x, y = (each.ravel() * apparent for each in np.meshgrid(side, side))
    worst = 0.0
    for source in np.radians(np.arange(0, 90, 10)):
        point = np.stack((x * np.cos(source), y, 1 + x * np.sin(source)), axis=1)
        normal = np.array((np.sin(source), 0.0, -np.cos(source)))
        for receiver in np.radians(np.arange(0, 80, 10)):
            for turn in np.radians(np.arange(0, 360, 45)):
                aside = np.sin(receiver) * np.array((np.cos(turn), np.sin(turn)))
                up = np.array((*aside, np.cos(receiver)))
                square = np.sum(point**2, axis=1)
                kernel = (point @ up).clip(0) * (-(point @ normal)).clip(0) / square**2
                worst = max(worst, abs(float(kernel.mean()) - float(np.cos(receiver) * np.cos(source))))
    return worst


def figure(small: bool) -> Figure:
    """Count clusters and rounds, and check both."""
    rng = np.random.default_rng(7)
    whole = clusters(ACROSS)
    assert 27_000 < whole < 28_500, whole
    assert abs(counted(ACROSS, rng, 200_000 if small else 2_000_000) / whole - 1) < 0.05
    doubled = clusters(2 * ACROSS) - whole
    assert 1_700 < doubled < 1_900, doubled
    for reflectance, others, count in ((0.3, 0.1, 3), (0.3, 1.0, 8), (0.5, 0.3, 7), (0.5, 1.0, 14)):
        assert rounds(reflectance, others) == count, (reflectance, others, rounds(reflectance, others))
    for reflectance in (0.3, 0.5, 0.8):
        shrinks, bound = observed(reflectance, 4, rng)
        assert shrinks <= 0.6 * bound < bound <= reflectance, (shrinks, bound)
    error = center_error(APPARENT)
    assert 0.003 < error < 0.006, error
    assert abs(center_error(APPARENT / 2) / error - 0.25) < 0.02
    rows = {row["triangles"]: row for row in json.loads(ROOMS.read_text())["rooms"]}
    most, fewer = sorted(rows)[-1], sorted(rows)[-2]
    bytes_each = 1e6 * (rows[most]["memory_MB"] - rows[fewer]["memory_MB"]) / (most - fewer)
    assert 1_500 < bytes_each < 2_100, bytes_each
    held = TRIANGLES / ACROSS**2 * (1 + 4 * HALO + np.pi * HALO**2)
    assert 1.42e6 < held < 1.44e6, held
    assert 2.2e9 < bytes_each * held < 2.9e9
    assert 0.32e6 < NUMBERS * whole < 0.35e6

    drawn, (left, right) = drawing.axes(2, 7.0, 2.9)
    reach = np.geomspace(1, 100, 50)
    for apparent in (0.2, 0.1, 0.05):
        left.loglog(reach, clusters(reach, apparent), label=f"size over distance ≤ {apparent:g}")
    left.set(xlabel="reach of the city [widths of a region]", ylabel="clusters a region sees")
    left.set_ylim(1e3, 2e6)
    left.legend(loc="upper left")
    tint = np.linspace(0.05, 0.9, 100)
    for others in (0.1, 0.3, 1.0):
        right.plot(tint, np.log(1e-4) / np.log(factor(tint, others)), label=f"{others:.0%}")
    right.set(xlabel="reflectance", ylabel="rounds to $10^{-4}$", ylim=(0, 40))
    right.legend(title="view of other regions")
    return drawn
