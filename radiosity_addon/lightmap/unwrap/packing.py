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
from .chart_profiles import Shapes, align, measure, outline
from .collapse import ChartPlaces, collapse, collapsed_corners
from .skyline import Placement, place

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int64]

GAP = 2
"""Free texels between charts that bilinear filtering asks for, without mip levels."""

SMALLEST = 0.25
"""Texels; a chart that would be narrower is widened to this, so that nothing gets lost."""

FINEST = 2048
"""Cells along a page's side; larger pages are packed in cells of several texels."""

FEW = 64
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
    """Aligned charts, their outlines, the orders worth trying, and where charts are if some may collapse."""

    uv: Float
    chart: Int
    edges: Float
    owner: Int
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
    job = _job(uv, chart, limits or Limits(), places)
    if density is not None:
        return _pack_at(job, density)
    finer = resolution
    while (packing := _pack_into(job, finer, resolution, progress)) is None:
        # Too small to keep the charts apart: pack a finer page and shrink it.
        finer *= 2
        job = replace(job, places=None)
    return packing


def _job(uv: Float, chart: Int, limits: Limits, places: ChartPlaces | None) -> _Job:
    count = int(chart.max()) + 1
    aligned = align(uv, chart, count)
    extent = np.zeros((count, 2))
    np.maximum.at(extent, chart, aligned.max(axis=1))
    long, short = extent.max(axis=1), extent.min(axis=1)
    orders = [np.lexsort((np.arange(count), -short, -long))]
    if count <= FEW:
        orders.append(np.lexsort((np.arange(count), -long, -extent.prod(axis=1))))
        orders.append(np.lexsort((np.arange(count), -long, -short)))
    area = float(0.5 * np.abs(signed_double_areas(aligned)).sum())
    edges, owner = outline(aligned, chart)
    # A few charts have room for their gaps.
    places = places if count > FEW else None
    return _Job(aligned, chart, edges, owner, extent, tuple(orders), area, limits, places)


@dataclass(frozen=True)
class _Scaled:
    """Cells per meter (count, 2) of each chart and the shapes they have then.

    For an even and for an odd number of quarter turns.
    """

    scale: tuple[Float, Float]
    shapes: tuple[Shapes, Shapes]


def _scaled(job: _Job, scale: float, cell: int, stretch: float = 1.0) -> _Scaled:
    """Return the charts at `scale` texels per meter, stretched along the page's u."""
    even = _measured(job, scale * np.array((stretch**0.5, stretch**-0.5)), cell)
    odd = even if stretch == 1.0 else _measured(job, scale * np.array((stretch**-0.5, stretch**0.5)), cell)
    return _Scaled((even[0], odd[0]), (even[1], odd[1]))


def _measured(job: _Job, scale: Float, cell: int) -> tuple[Float, Shapes]:
    """Return cells per meter (count, 2) at `scale` (2,) texels per meter, and the charts' shapes."""
    extent = job.extent * scale
    widen = np.where(extent < SMALLEST, SMALLEST / np.maximum(extent, 1e-30), 1.0)
    cells = scale / cell * widen
    return cells, measure(job.edges * cells[job.owner][:, None], job.owner, job.extent * cells)


def _pack_into(job: _Job, resolution: int, page: int, progress: Progress) -> Packing | None:
    """Look for the largest scale that fits a page of `resolution`; None if none does.

    `page` is the page's real size when `resolution` is a finer stand-in for it.
    """
    cell = -(-resolution // FINEST)
    side = resolution // cell - 2 * job.limits.border(cell)
    count = len(job.extent)
    if side < 1:
        return None
    full = resolution / float(np.sqrt(job.area))
    best: Packing | None = None
    low, scale, trials = 0.0, 0.85 * full, int(np.clip(6000 // count, 6, 40))
    for stretch in STRETCHES if count <= FEW else (1.0,):
        high = full
        for _ in range(trials):
            placed, height = _placed(job, scale, side, cell, stretch)
            if placed is not None:
                low = scale
                best = _packing(placed, resolution, page, scale)
            else:
                high = scale
            progress.at(0.0)
            if low == 0.0:
                if high * job.extent.max() < SMALLEST:
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
        cell = -(-resolution // FINEST)
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


def _too_dense(density: float, largest: int) -> BakeError:
    return BakeError(
        f"a texel density of {density:g} px/m needs an atlas page above {largest} px: "
        "lower the density, bake fewer objects, or give each object its own page"
    )


def _placed(
    job: _Job, scale: float, side: int, cell: int, stretch: float = 1.0
) -> tuple[Float | None, int]:
    """Place the charts within a square of `side` cells, at `scale` texels per meter.

    Returns (n, 3, 2) corners in texels of the page, or None if they do not fit; and the height reached [cells].
    """
    block = collapse(job.places, job.extent * scale, scale, side * cell)
    if block is None:
        return None, 0
    below = -(-block.rows // cell) + job.limits.gap(cell) if block.rows else 0
    border = job.limits.border(cell)
    if not block.is_in.any():
        scaled = _scaled(job, scale, cell, stretch)
        placement, height = _place(job, scaled.shapes, (side, side), cell)
        return None if placement is None else _moved(job, scaled, placement, cell) * cell, height
    corners = collapsed_corners(block, job.uv, job.chart, job.extent) + border * cell
    part, rows = _without(job, block.is_in)
    if not len(rows):
        return (corners if block.rows <= side * cell else None), block.rows // cell
    if below >= side:
        return None, below + side
    scaled = _scaled(part, scale, cell, stretch)
    placement, height = _place(part, scaled.shapes, (side, side - below), cell)
    if placement is None:
        return None, height + below if height else 0
    corners[rows] = (_moved(part, scaled, placement, cell) + (0, below)) * cell
    return corners, height + below


def _without(job: _Job, left_out: NDArray[np.bool_]) -> tuple[_Job, NDArray[np.intp]]:
    """Return the other charts, renumbered, and the triangles they have."""
    number = np.cumsum(~left_out) - 1
    rows = np.flatnonzero(~left_out[job.chart])
    edges = ~left_out[job.owner]
    orders = tuple(number[order[~left_out[order]]] for order in job.orders)
    part = replace(
        job,
        uv=job.uv[rows],
        chart=number[job.chart[rows]],
        edges=job.edges[edges],
        owner=number[job.owner[edges]],
        extent=job.extent[~left_out],
        orders=orders,
    )
    return part, rows


def _place(
    job: _Job, shapes: tuple[Shapes, Shapes], room: tuple[int, int], cell: int
) -> tuple[Placement | None, int]:
    """Return the first placement in a room so wide and high [cells], else None and the height reached."""
    gap, (width, height) = job.limits.gap(cell), room
    even = shapes[0]
    longest = np.maximum(even.width, even.height).max(), np.minimum(even.width, even.height).max()
    if max(longest) > max(room) or longest[1] > min(room):
        return None, 0
    if ((even.width + gap) * (even.height + gap) * even.boxy).sum() > 1.3 * (width + gap) * (height + gap):
        return None, 0
    few = len(job.extent) <= FEW
    for order in job.orders:
        for thrifty in (False, True) if few else (True,):
            placement = place(shapes, order, width, gap, height if few else None, thrifty)
            if placement is not None and placement.height <= height:
                return placement, placement.height
    return None, placement.height if placement is not None else 0


def _moved(job: _Job, scaled: _Scaled, placement: Placement, cell: int) -> Float:
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
