"""Which objects share a page, where one page is not enough for all."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

FULL = 0.75
"""How much of a page charts fill in general; the rest is padding and odd corners."""


def assign_pages(surfaces: Sequence[float], pages: int) -> list[list[int]]:
    """Share objects out over pages so that all are about equally full.

    The largest first, each to the emptiest page. Objects of a page keep their order.

    Parameters
    ----------
    surfaces : sequence of float
        What each object takes of a page.
    pages : int

    Returns
    -------
    list of list of int
        Per page the objects' numbers; no page is empty.
    """
    emptiest = [(0.0, page) for page in range(min(pages, len(surfaces)))]
    groups: list[list[int]] = [[] for _ in emptiest]
    for number in sorted(range(len(surfaces)), key=lambda each: -surfaces[each]):
        filled, page = heapq.heappop(emptiest)
        groups[page].append(number)
        heapq.heappush(emptiest, (filled + surfaces[number], page))
    # Objects without a surface may leave pages empty only where there are none with one.
    return [sorted(group) for group in groups if group]


def least_pages(surface: float, density: float, largest: int) -> int:
    """Return how many pages of at most `largest` texels a side a surface [m²] needs at least."""
    return max(1, int(surface * density**2 / (FULL * largest**2)))
