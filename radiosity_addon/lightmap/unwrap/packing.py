"""Packing charts into one square page, as large as they fit or at a given density.

Charts keep their shape and their common scale; each box starts on a texel's border. Between
the texels that any two charts cover at least `Limits.padding` texels stay free, and half as many
at the page's border, so neither bilinear filtering nor dilation mixes charts. The packer of xatlas was
measured and left aside: it stretches every chart to whole texels, spills into more pages without
a limit on time, and cannot be run twice on one atlas (docs/decisions/0005).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...base import SILENT, BakeError, Progress
from ...numerics import signed_double_areas
from ...options import MAX_RESOLUTION
from .align import align
from .chart_masks import ChartMasks, chart_masks
from .collapse import STRETCH, ChartPlaces, collapse, collapsed_corners
from .occupancy import Placement, place

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int64]

GAP = 2
"""Free texels between charts that bilinear filtering asks for, without mip levels."""

MIN_CHART_WIDTH = 0.25
"""Texels; a chart that would be narrower is widened to this, so that nothing gets lost."""

MAX_CELLS = 2048
"""Cells along a page's side; larger pages are packed in cells of several texels."""

FEW_CHARTS = 64
"""Up to this many charts several orders, rules and stretches are tried; each costs a packing."""

STRETCHES = (1.0, 0.8, 0.85, 0.9, 0.95, 1.05, 1.1, 1.15, 1.2, 1.25)
"""Texels per meter along u over those along v, the same for all charts of a page.

A few large charts rarely fill a square; texels up to a quarter longer than wide do no harm and
bring up to a quarter more of them.
"""


SNAP = 0.05
"""Charts are shrunk by up to this part along a side where that saves a row of cells."""

TRIALS, PRECISION = (12, 40), (1.004, 1.002)
"""Scales tried at most, and the ratio of one that does not fit to one that does: for many charts, for few."""


@dataclass(frozen=True)
class Packing:
    """A packed page.

    Parameters
    ----------
    uv : (n, 3, 2) float32
        In [0, 1].
    resolution : int
    density : float
        Texels per meter, the geometric mean of those along u and v.
    crowded : bool
        Whether the page is too small to keep the charts two texels apart.
    """

    uv: Float32
    resolution: int
    density: float
    crowded: bool = False


@dataclass(frozen=True)
class Limits:
    """What pages must keep to.

    Parameters
    ----------
    largest : int
        Width and height of a page at most.
    padding : int
        Free texels between charts.
    """

    largest: int = MAX_RESOLUTION
    padding: int = GAP

    @property
    def side(self) -> int:
        """Largest width and height of a page whose size follows from a density."""
        return max(4, 4 * (self.largest // 4))

    def gap(self, cell: int) -> int:
        """Free cells of `cell` texels between charts."""
        return -(-self.padding // cell)

    def border(self, cell: int) -> int:
        """Free cells along the page's border: pages are repeated in the mind of a sampler."""
        return -(-self.gap(cell) // 2)


def page_size(texels: float) -> int:
    """Return the size of a page that is to have at least `texels` along a side: a multiple of 4."""
    return max(4, 4 * math.ceil(texels / 4))


def padding_for(mip_levels: int) -> int:
    """Return the free texels between charts that keep them apart down to a mip level.

    At level L a texel is 2^L wide, and bilinear filtering reaches 1.5 of them beyond a chart.
    """
    return (3 * (1 << mip_levels) + 1) // 2


@dataclass(frozen=True)
class ChartJob:
    """Aligned charts, the orders worth trying, and where charts are if some may collapse."""

    uv: Float
    chart: Int
    extent: Float
    orders: tuple[Int, ...]
    area: float
    limits: Limits
    places: ChartPlaces | None


def pack(
    uv: Float,
    chart: Int,
    resolution: int,
    density: float | None,
    limits: Limits | None = None,
    progress: Progress = SILENT,
    places: ChartPlaces | None = None,
) -> Packing:
    """Pack charts into a square page.

    Parameters
    ----------
    uv : (n, 3, 2) float64
        Charts, 1 unit = 1 m.
    chart : (n,) int64
        0 … count − 1, none missing.
    resolution : int
        The page's size, if no density is given.
    density : float or None
        Texels per meter; the page becomes the smallest square multiple of 4 that holds it.
    limits : Limits or None
    progress : Progress
        How many trials there will be is not known: it stays where it is.
    places : ChartPlaces or None
        Where the charts are in the scene: many small ones are then collapsed. None keeps all shapes.

    Raises
    ------
    BakeError
        If the density asks for more than the largest page.
    """
    job = chart_job(uv, chart, limits or Limits(), places)
    if density is not None:
        return pack_at(job, density)
    finer = resolution
    while (packing := _pack_into(job, finer, resolution, progress)) is None:
        # Too small to keep the charts apart: pack a finer page and shrink it.
        finer *= 2
        job = replace(job, places=None)
    return packing


def chart_job(uv: Float, chart: Int, limits: Limits, places: ChartPlaces | None) -> ChartJob:
    """Return charts prepared for packing; for `places` see `pack`."""
    count = int(chart.max()) + 1
    aligned = align(uv, chart, count)
    extent = np.zeros((count, 2))
    np.maximum.at(extent, chart, aligned.max(axis=1))
    long, short = extent.max(axis=1), extent.min(axis=1)
    orders = [np.lexsort((np.arange(count), -short, -long))]
    if count <= FEW_CHARTS:
        orders.append(np.lexsort((np.arange(count), -long, -extent.prod(axis=1))))
        orders.append(np.lexsort((np.arange(count), -long, -short)))
    area = float(0.5 * np.abs(signed_double_areas(aligned)).sum())
    # A few charts have room for their gaps.
    places = places if count > FEW_CHARTS else None
    return ChartJob(aligned, chart, extent, tuple(orders), area, limits, places)


@dataclass(frozen=True)
class _ScaledCharts:
    """Cells per meter (count, 2) of each chart and the cells that it covers then.

    For an even and for an odd number of quarter turns.
    """

    scale: tuple[Float, Float]
    masks: tuple[ChartMasks, ChartMasks]


def _scaled(job: ChartJob, scale: float, cell: int, side: int, stretch: float = 1.0) -> _ScaledCharts:
    """Return the charts at `scale` texels per meter, stretched along u, for a room of `side` cells."""
    even = _measured(job, scale * np.array((stretch**0.5, stretch**-0.5)), cell, side)
    if stretch == 1.0:
        return _ScaledCharts((even[0], even[0]), (even[1], even[1]))
    odd = _measured(job, scale * np.array((stretch**-0.5, stretch**0.5)), cell, side)
    return _ScaledCharts((even[0], odd[0]), (even[1], odd[1]))


def _measured(job: ChartJob, scale: Float, cell: int, side: int) -> tuple[Float, ChartMasks]:
    """Return cells per meter (count, 2) at `scale` (2,) texels per meter, and the cells charts cover."""
    extent = job.extent * scale
    widen = np.where(extent < MIN_CHART_WIDTH, MIN_CHART_WIDTH / np.maximum(extent, 1e-30), 1.0)
    if job.places is not None:
        too_long = (extent > side * cell) & (extent <= STRETCH * side * cell)
        widen = np.where(too_long, side * cell / extent, widen)
    cells = scale / cell * widen
    if job.places is not None:
        taken = job.extent * cells
        whole = np.floor(taken)
        cells = (
            np.where((whole < taken) & (whole > (1.0 - SNAP) * taken), whole / np.maximum(taken, 1e-30), 1.0)
            * cells
        )
    return cells, chart_masks(job.uv * cells[job.chart][:, None], job.chart, job.extent * cells)


def _pack_into(job: ChartJob, resolution: int, page: int, progress: Progress) -> Packing | None:
    """Look for the largest scale that fits a page of `resolution`; None if none does.

    `page` is the page's real size when `resolution` is a finer stand-in for it.
    """
    cell = -(-resolution // MAX_CELLS)
    side = resolution // cell - 2 * job.limits.border(cell)
    count = len(job.extent)
    if side < 1:
        return None
    full = resolution / float(np.sqrt(job.area))
    best: Packing | None = None
    few = count <= FEW_CHARTS
    low, scale = 0.0, (0.85 if few else 0.75) * full
    for stretch in STRETCHES if few else (1.0,):
        high = np.inf
        for _ in range(TRIALS[few]):
            placed, room = _placed(job, scale, side, cell, stretch)
            if placed is not None:
                low = scale
                best = _packing(placed, resolution, page, scale)
            else:
                high = scale
            progress.at(0.0)
            if low == 0.0:
                if high * job.extent.max() < MIN_CHART_WIDTH:
                    break
                scale *= float(np.clip(np.sqrt(room), 0.25, 0.98)) if room else 0.5
            elif high < low * PRECISION[few]:
                break
            elif high == np.inf:
                scale *= max(float(np.sqrt(room)), PRECISION[few]) * PRECISION[few]
            else:
                scale = float(np.sqrt(low * high))
        if low == 0.0:
            return best
        # Another stretch is worth a search only if it beats the best so far.
        scale = low * PRECISION[few]
    return best


def pack_at(job: ChartJob, density: float) -> Packing:
    """Return the smallest page that holds the charts at `density` texels per meter."""
    largest = job.limits.side
    reach = float(job.extent.max()) * density + 2 * job.limits.border(1)
    guess = max(float(np.sqrt(job.area)) * density, reach if len(job.extent) == 1 else 0.7 * reach)
    if not guess <= largest:
        raise too_dense(density, largest)
    step = 1.0
    resolution, too_small, best = page_size(guess), 0, None
    while best is None or best.resolution - too_small > max(4, best.resolution // 256):
        if resolution > largest:
            raise too_dense(density, largest)
        cell = -(-resolution // MAX_CELLS)
        side = resolution // cell - 2 * job.limits.border(cell)
        placed, _ = _placed(job, density, side, cell) if side > 0 else (None, 0)
        if placed is not None:
            best = _packing(placed, resolution, resolution, density)
            resolution = page_size((too_small + best.resolution) / 2)
        else:
            too_small = resolution
            step *= 1.5
            grown = resolution * (1 + 0.02 * step) if best is None else (resolution + best.resolution) / 2
            # The largest page is tried before giving up.
            ceiling = largest if too_small < largest else 2 * largest
            resolution = min(page_size(max(grown, resolution + 1)), ceiling)
        if best is not None and resolution >= best.resolution:
            return best
    return best


def too_dense(density: float, largest: int) -> BakeError:
    """Return the error of a density that needs more than the largest page."""
    return BakeError(
        f"a texel density of {density:g} px/m needs an atlas page above {largest} px: "
        "lower the density, bake fewer objects, or give each object its own page"
    )


def _placed(
    job: ChartJob, scale: float, side: int, cell: int, stretch: float = 1.0
) -> tuple[Float | None, float]:
    """Place the charts within a square of `side` cells, at `scale` texels per meter.

    Returns (n, 3, 2) corners in texels of the page, or None if they do not fit.
    Returns by which factor the charts' area might change: the room there is to what they take, 0 if unknown.
    """
    block = collapse(job.places, job.extent * scale, scale, side * cell)
    if block is None:
        return None, 0.0
    below = -(-block.rows // cell) + job.limits.gap(cell) if block.rows else 0
    part, rows = _without(job, block.is_in) if block.rows else (job, np.arange(len(job.uv)))
    if len(rows):
        scaled = _scaled(part, scale, cell, side, stretch)
        placement, share = _place(part, scaled.masks, (side, side - below), cell)
        if placement is None:
            return None, share
        placed, height = _moved(part, scaled, placement, cell) * cell, below + placement.height
        if not block.rows:
            return placed, side / height
    elif block.rows > side * cell:
        return None, side * cell / block.rows
    corners = collapsed_corners(block, job.uv, job.chart, job.extent) + job.limits.border(cell) * cell
    if len(rows):
        corners[rows] = placed + np.array((0, below * cell))
        return corners, side / height
    return corners, side * cell / block.rows


def _without(job: ChartJob, left_out: NDArray[np.bool_]) -> tuple[ChartJob, NDArray[np.intp]]:
    """Return the other charts, renumbered, and the triangles they have."""
    number = np.cumsum(~left_out) - 1
    rows = np.flatnonzero(~left_out[job.chart])
    orders = tuple(number[order[~left_out[order]]] for order in job.orders)
    part = replace(
        job,
        uv=job.uv[rows],
        chart=number[job.chart[rows]],
        extent=job.extent[~left_out],
        orders=orders,
    )
    return part, rows


def _place(
    job: ChartJob, masks: tuple[ChartMasks, ChartMasks], room: tuple[int, int], cell: int
) -> tuple[Placement | None, float]:
    """Return the first placement in a room so wide and high [cells], else None and which part was placed."""
    gap, (width, height) = job.limits.gap(cell), room
    even = masks[0]
    longest = np.maximum(even.width, even.height).max(), np.minimum(even.width, even.height).max()
    if longest[0] > max(room) or longest[1] > min(room):
        return None, 0.0
    needed, free = (
        ((even.width + gap) * (even.height + gap) * even.boxy).sum(),
        (width + gap) * (height + gap),
    )
    if needed > free:
        return None, float(free / needed)
    share = 0.0
    for order in job.orders:
        placement, part = place(masks, order, width, height, gap)
        if placement is not None:
            return placement, 1.0
        share = max(share, part)
    return None, share


def _moved(job: ChartJob, scaled: _ScaledCharts, placement: Placement, cell: int) -> Float:
    """Return (n, 3, 2) chart corners turned and moved to their place [cells]."""
    chart = job.chart
    quarter = placement.quarter[chart]
    odd = (quarter % 2 == 1)[:, None]
    local = job.uv * np.where(odd, scaled.scale[1][chart], scaled.scale[0][chart])[:, None]
    x, y = local[..., 0], local[..., 1]
    even_box, odd_box = (np.stack((mask.width, mask.height), axis=-1)[chart] for mask in scaled.masks)
    width, height = (np.where(odd, odd_box, even_box)[:, k : k + 1] for k in (0, 1))
    u = np.choose(quarter[:, None], (x, height - y, width - x, y))
    v = np.choose(quarter[:, None], (y, x, height - y, width - x))
    corner = np.stack((placement.x, placement.y), axis=-1)[chart][:, None] + job.limits.border(cell)
    return np.asarray(np.stack((u, v), axis=-1) + corner)


def _packing(texels: Float, resolution: int, page: int, density: float) -> Packing:
    """Scale from texels of a page of `resolution` to [0, 1]."""
    uv = np.clip(texels / resolution, 0, 1).astype(np.float32)
    return Packing(uv, page, density * page / resolution, crowded=resolution != page)
