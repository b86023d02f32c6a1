"""How many texels objects need, and which of them share a page."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...numerics import Array

FULL = 0.93
"""Share of a page that charts fill with the gaps around them; the rest is odd corners."""

_HALVINGS = 60
"""Of the bracket around a density."""


@dataclass(frozen=True)
class ChartTotals:
    """Sums over the charts of each object; many small charts need more room than one of the same area.

    area: (n,) float [m²].
    length: (n,) float, width plus height of each chart's box [m].
    count: (n,) float, number of charts.
    padding: Free texels between charts.
    most_gaps: Gaps of one texel take no more than this part of the surface's texels, however many charts
        there are: what is smaller than a texel needs none, and small charts lie in the hollows of others.
    """

    area: Array
    length: Array
    count: Array
    padding: int
    most_gaps: float = 1.0

    def texels(self, density: float) -> Array:
        """Return (n,) texels that each object takes at `density` texels per meter, with gaps and corners."""
        gap = self.padding + 1  # a chart's border also cuts through texels
        surface, most = self.area * density**2, self.most_gaps * gap * self.area * density**2
        gaps = gap * self.length * density + gap**2 * self.count
        return np.asarray((surface + gaps * most / np.maximum(gaps + most, 1e-300)) / FULL)

    def density(self, texels: float) -> float:
        """Return the texels per meter at which all objects fill `texels`; 0 if they have no area."""
        area = float(self.area.sum())
        if area <= 0.0:
            return 0.0
        high = float(np.sqrt(FULL * texels / area))
        low = high / float(np.sqrt(1.0 + self.most_gaps * (self.padding + 1)))
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if float(self.texels(middle).sum()) > texels:
                high = middle
            else:
                low = middle
        return low

    def least_pages(self, density: float, largest: int) -> int:
        """Return a number of pages, of `largest` texels a side, that all objects may just fit on."""
        return max(1, int(FULL * float(self.texels(density).sum()) / largest**2))


def assign_pages(
    texels: Sequence[float] | Array, pages: int, wanted: Sequence[int] | None = None
) -> list[list[int]]:
    """Share objects out over pages so that all are about equally full.

    Those that name a page come first, then the largest, each to the emptiest page. Objects of a page keep
    their order.

    Parameters
    ----------
    texels : (n,) float
        Number of texels that each object takes.
    pages : int
    wanted : (n,) int or None
        The page that each object names, from 1; 0, or None for all, for none.

    Returns
    -------
    list of list of int
        Row numbers of the objects of each page; no page is empty.
    """
    named = np.zeros(len(texels), dtype=np.int64) if wanted is None else np.asarray(wanted, dtype=np.int64)
    free = int((named == 0).sum())
    pages = max(min(pages, free + len(set(named[named > 0].tolist()))), int(named.max(initial=0)))
    groups: list[list[int]] = [[] for _ in range(pages)]
    for row in np.flatnonzero(named).tolist():
        groups[named[row] - 1].append(row)
    emptiest = [(sum(float(texels[row]) for row in group), page) for page, group in enumerate(groups)]
    heapq.heapify(emptiest)
    for row in np.argsort(-np.asarray(texels), kind="stable").tolist():
        if named[row]:
            continue
        filled, page = heapq.heappop(emptiest)
        groups[page].append(row)
        heapq.heappush(emptiest, (filled + float(texels[row]), page))
    # Objects that take no texels all go to one page.
    return [sorted(group) for group in groups if group]
