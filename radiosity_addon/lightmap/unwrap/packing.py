"""Packing charts into one square page, as large as they fit or at a given density.

Charts keep their shape and their common scale; each box starts on a texel's border. Between
the texels that any two charts cover at least `Limits.padding` texels stay free, and half as many
at the page's border, so neither bilinear filtering nor dilation mixes charts. The packer of xatlas was
measured and left aside: it stretches every chart to whole texels, spills into more pages without
a limit on time, and cannot be run twice on one atlas (docs/decisions/0005).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...base import SILENT, BakeError, Progress
from ...numerics import signed_double_areas
from ...options import MAX_RESOLUTION
from .chart_profiles import Shapes, align, measure, outline
from .skyline import Placement, place

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
class _Job:
    """Aligned charts, their outlines, and the orders worth trying."""

    uv: Float
    chart: Int
    edges: Float
    owner: Int
    extent: Float
    orders: tuple[Int, ...]
    area: float
    limits: Limits


def pack(
    uv: Float,
    chart: Int,
    resolution: int,
    density: float | None,
    limits: Limits | None = None,
    progress: Progress = SILENT,
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

    Raises
    ------
    BakeError
        If the density asks for more than the largest page.
    """
    job = _job(uv, chart, limits or Limits())
    if density is not None:
        return _pack_at(job, density)
    finer = resolution
    while (packing := _pack_into(job, finer, resolution, progress)) is None:
        # Too small to keep the charts apart: pack a finer page and shrink it.
        finer *= 2
    return packing


def _job(uv: Float, chart: Int, limits: Limits) -> _Job:
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
    return _Job(aligned, chart, *outline(aligned, chart), extent, tuple(orders), area, limits)


@dataclass(frozen=True)
class _ScaledCharts:
    """Cells per meter (count, 2) of each chart and the shapes they have then.

    For an even and for an odd number of quarter turns.
    """

    scale: tuple[Float, Float]
    shapes: tuple[Shapes, Shapes]


def _scaled(job: _Job, scale: float, cell: int, stretch: float = 1.0) -> _ScaledCharts:
    """Return the charts at `scale` texels per meter, stretched along the page's u."""
    even = _measured(job, scale * np.array((stretch**0.5, stretch**-0.5)), cell)
    odd = even if stretch == 1.0 else _measured(job, scale * np.array((stretch**-0.5, stretch**0.5)), cell)
    return _ScaledCharts((even[0], odd[0]), (even[1], odd[1]))


def _measured(job: _Job, scale: Float, cell: int) -> tuple[Float, Shapes]:
    """Return cells per meter (count, 2) at `scale` (2,) texels per meter, and the charts' shapes."""
    extent = job.extent * scale
    widen = np.where(extent < MIN_CHART_WIDTH, MIN_CHART_WIDTH / np.maximum(extent, 1e-30), 1.0)
    cells = scale / cell * widen
    return cells, measure(job.edges * cells[job.owner][:, None], job.owner, job.extent * cells)


def _pack_into(job: _Job, resolution: int, page: int, progress: Progress) -> Packing | None:
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
    low, scale, trials = 0.0, 0.85 * full, int(np.clip(6000 // count, 6, 40))
    for stretch in STRETCHES if count <= FEW_CHARTS else (1.0,):
        high = full
        for _ in range(trials):
            scaled = _scaled(job, scale, cell, stretch)
            placement, height = _place(job, scaled.shapes, side, cell)
            if placement is not None:
                low = scale
                best = _packing(_moved(job, scaled, placement, cell) * cell, resolution, page, scale)
            else:
                high = scale
            progress.at(0.0)
            if low == 0.0:
                if high * job.extent.max() < MIN_CHART_WIDTH:
                    break
                guess = scale * np.sqrt(side / height) if height else 0.5 * scale
                scale = float(np.clip(guess, 0.25 * scale, 0.97 * scale))
            elif high < low * 1.002:
                break
            else:
                scale = float(np.sqrt(low * high))
        if low == 0.0:
            return best
        # Another stretch is worth a search only if it beats the best so far.
        scale = low * 1.002
    return best


def _pack_at(job: _Job, density: float) -> Packing:
    """Find the smallest page that holds the charts at `density` texels per meter."""
    largest = job.limits.side
    reach = float(job.extent.max()) * density + 2 * job.limits.border(1)
    guess = max(float(np.sqrt(job.area)) * density, reach if len(job.extent) == 1 else 0.7 * reach)
    if not guess <= largest:
        raise _too_dense(density, largest)
    step = 1.0
    resolution, too_small, best = page_size(guess), 0, None
    while best is None or best.resolution - too_small > max(4, best.resolution // 256):
        if resolution > largest:
            raise _too_dense(density, largest)
        cell = -(-resolution // MAX_CELLS)
        side = resolution // cell - 2 * job.limits.border(cell)
        scaled = _scaled(job, density, cell)
        placement, _ = _place(job, scaled.shapes, side, cell) if side > 0 else (None, 0)
        if placement is not None:
            moved = _moved(job, scaled, placement, cell)
            best = _packing(moved * cell, resolution, resolution, density)
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


def _too_dense(density: float, largest: int) -> BakeError:
    return BakeError(
        f"a texel density of {density:g} px/m needs an atlas page above {largest} px: "
        "lower the density, bake fewer objects, or give each object its own page"
    )


def _place(job: _Job, shapes: tuple[Shapes, Shapes], side: int, cell: int) -> tuple[Placement | None, int]:
    """Return the first placement within a square of `side` cells, else None and the height reached."""
    gap = job.limits.gap(cell)
    even = shapes[0]
    if min(max(shape.width.max(), shape.height.max()) for shape in shapes) > side:
        return None, 0
    if ((even.width + gap) * (even.height + gap) * even.boxy).sum() > 1.3 * (side + gap) ** 2:
        return None, 0
    few = len(job.extent) <= FEW_CHARTS
    for order in job.orders:
        for thrifty in (False, True) if few else (True,):
            placement = place(shapes, order, side, gap, side if few else None, thrifty)
            if placement is not None and placement.height <= side:
                return placement, placement.height
    return None, placement.height if placement is not None else 0


def _moved(job: _Job, scaled: _ScaledCharts, placement: Placement, cell: int) -> Float:
    """Return (n, 3, 2) chart corners turned and moved to their place [cells]."""
    chart = job.chart
    quarter = placement.quarter[chart]
    odd = (quarter % 2 == 1)[:, None]
    local = job.uv * np.where(odd, scaled.scale[1][chart], scaled.scale[0][chart])[:, None]
    x, y = local[..., 0], local[..., 1]
    even_box, odd_box = (np.stack((shape.width, shape.height), axis=-1)[chart] for shape in scaled.shapes)
    width, height = (np.where(odd, odd_box, even_box)[:, k : k + 1] for k in (0, 1))
    u = np.choose(quarter[:, None], (x, height - y, width - x, y))
    v = np.choose(quarter[:, None], (y, x, height - y, width - x))
    corner = np.stack((placement.x, placement.y), axis=-1)[chart][:, None] + job.limits.border(cell)
    return np.asarray(np.stack((u, v), axis=-1) + corner)


def _packing(texels: Float, resolution: int, page: int, density: float) -> Packing:
    """Scale from texels of a page of `resolution` to [0, 1]."""
    uv = np.clip(texels / resolution, 0, 1).astype(np.float32)
    return Packing(uv, page, density * page / resolution, crowded=resolution != page)
