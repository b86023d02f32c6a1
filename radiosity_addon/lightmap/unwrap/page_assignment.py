"""How many texels objects need, and which of them share a page."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...numerics import Array

FULL = 0.75
"""Share of a page that charts fill with the gaps around them; the rest is odd corners."""


@dataclass(frozen=True)
class ChartTotals:
    """Sums over the charts of each object; many small charts need more room than one of the same area.

    area: (n,) float [m²].
    length: (n,) float, width plus height of each chart's box [m].
    count: (n,) float, number of charts.
    padding: Free texels between charts.
    """

    area: Array
    length: Array
    count: Array
    padding: int

    def texels(self, density: float) -> Array:
        """Return (n,) texels that each object takes at `density` texels per meter, with gaps and corners."""
        gap = self.padding + 1  # a chart's border also cuts through texels
        return (self.area * density**2 + gap * self.length * density + gap**2 * self.count) / FULL

    def density(self, texels: float) -> float:
        """Return the texels per meter at which all objects fill `texels`; 0 if they have no area."""
        area, gap = float(self.area.sum()), self.padding + 1
        if area <= 0.0:
            return 0.0
        linear, room = gap * float(self.length.sum()), FULL * texels - gap**2 * float(self.count.sum())
        if room <= 0.0:
            # Not even the gaps fit: such a page is packed at twice its size and shrunk.
            return 0.5 * self.density(4.0 * texels)
        return float(2.0 * room / (linear + np.sqrt(linear**2 + 4.0 * area * room)))

    def least_pages(self, density: float, largest: int) -> int:
        """Return a number of pages, of `largest` texels a side, that all objects may just fit on."""
        return max(1, int(FULL * float(self.texels(density).sum()) / largest**2))


def assign_pages(texels: Sequence[float] | Array, pages: int) -> list[list[int]]:
    """Share objects out over pages so that all are about equally full.

    The largest first, each to the emptiest page. Objects of a page keep their order.

    Parameters
    ----------
    texels : (n,) float
        Number of texels that each object takes.
    pages : int

    Returns
    -------
    list of list of int
        Row numbers of the objects of each page; no page is empty.
    """
    emptiest = [(0.0, page) for page in range(min(pages, len(texels)))]
    groups: list[list[int]] = [[] for _ in emptiest]
    for row in np.argsort(-np.asarray(texels), kind="stable").tolist():
        filled, page = heapq.heappop(emptiest)
        groups[page].append(row)
        heapq.heappush(emptiest, (filled + float(texels[row]), page))
    # Objects that take no texels all go to one page.
    return [sorted(group) for group in groups if group]
