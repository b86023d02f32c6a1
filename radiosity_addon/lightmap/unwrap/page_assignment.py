"""Which objects share a page, where one page is not enough for all."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

import numpy as np

from ...numerics import Array

FULL = 0.75
"""How much of a page charts fill in general; the rest is padding and odd corners."""


def texels_needed(
    surfaces: Sequence[float],
    extents: Sequence[Array],
    padding: int,
    density: float | None,
    texels: float,
) -> list[float]:
    """Return the texels that each object takes of a page, with those that stay free around its charts.

    Many small charts need more room than a large one of the same surface.

    Parameters
    ----------
    surfaces : sequence of float
        Of each object [m²].
    extents : sequence of (c, 2) float
        Width and height of each object's charts [m].
    padding : int
        Free texels between charts.
    density : float or None
        Texels per meter; None takes what fits.
    texels : float
        Of all pages together, if no density is given.
    """
    gap = padding + 1  # a chart's border also cuts through texels
    area = np.asarray(surfaces, dtype=np.float64)
    along = gap * np.array([sizes.sum() for sizes in extents])
    free = gap**2 * np.array([float(len(sizes)) for sizes in extents])
    if density is None:
        a, b, c = (float(of.sum()) for of in (area, along, free))
        room = max(FULL * texels - c, 0.0)
        # The density at which a d² + b d + c texels are in use.
        density = 2.0 * room / (b + np.sqrt(b**2 + 4.0 * a * room)) if room and a else 0.0
    return list(map(float, area * density**2 + along * density + free))


def assign_pages(needs: Sequence[float], pages: int) -> list[list[int]]:
    """Share objects out over pages so that all are about equally full.

    The largest first, each to the emptiest page. Objects of a page keep their order.

    Parameters
    ----------
    needs : sequence of float
        What each object takes of a page.
    pages : int

    Returns
    -------
    list of list of int
        Per page the objects' numbers; no page is empty.
    """
    emptiest = [(0.0, page) for page in range(min(pages, len(needs)))]
    groups: list[list[int]] = [[] for _ in emptiest]
    for number in sorted(range(len(needs)), key=lambda each: -needs[each]):
        filled, page = heapq.heappop(emptiest)
        groups[page].append(number)
        heapq.heappush(emptiest, (filled + needs[number], page))
    # Objects that need nothing may leave pages empty only where there are none with one.
    return [sorted(group) for group in groups if group]


def least_pages(surface: float, density: float, largest: int) -> int:
    """Return how many pages of at most `largest` texels a side a surface [m²] needs at least."""
    return max(1, int(surface * density**2 / (FULL * largest**2)))
