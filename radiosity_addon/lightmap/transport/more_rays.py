"""More rays for texels that have gathered: what was traced stays, and points go on with their sequences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, Scratch, tiles
from .gather_points import gather_more
from .hit_table import TILE_HITS, HitTable, TableRows
from .sub_cells import SubCellHits, SubCellLinks, gather_sub_cells
from .sweeps import TexelTransport
from .traced_texels import GatherPointLayout

GATHERED = 0.6
"""How much is done when the points have gathered, and cells begin."""


def with_more_rays(
    table: HitTable,
    transport: TexelTransport,
    layout: GatherPointLayout,
    rows: TableRows,
    factor: float,
    below: Array,
    cell_rays: int,
    progress: Progress = SILENT,
) -> tuple[TexelTransport, GatherPointLayout, TableRows]:
    """Let points gather with `factor` times as many rays, and the cells that these meet.

    Cells that more rays meet now, so that they should have more of their own, gather anew.

    rows: Of the table of radiosity that the links' sources are.
    below (n,) int32: The leaf elements below the texels, or NOTHING.
    cell_rays: Most rays of a cell.
    """
    scratch, links = table.geometry.scratch, transport.links
    aimed = replace(links.aimed, sources=_numbers(rows, links.aimed.sources, scratch))
    numbered = replace(links, sources=_numbers(rows, links.sources, scratch), aimed=aimed)
    known = [_hits(of_kind, table, rows, scratch) for of_kind in transport.cells.links]
    gathering, of_cells = progress.part(0.0, GATHERED), progress.part(GATHERED, 1.0)
    links, layout = gather_more(
        table.local, table.crossings, table.number, numbered, layout, factor, gathering
    )
    del numbered, aimed
    cells, rows = gather_sub_cells(table, links, below, transport.reflectance, cell_rays, known, of_cells)
    return TexelTransport(links, cells, transport.reflectance), layout, rows


def _hits(links: SubCellLinks, table: HitTable, rows: TableRows, scratch: Scratch) -> SubCellHits:
    """Return cells as they were before their numbers became rows."""
    number = rows.numbers(links.rows)
    return SubCellHits(
        bool(len(number)) and bool(number[0] < table.first_cell),
        number,
        _numbers(rows, links.sources, scratch),
        links.gains,
        links.tints,
        links.lamps,
    )


def _numbers(rows: TableRows, sources: Array, scratch: Scratch) -> Array:
    """Return (k, rays) int32 the numbers of rows."""
    result = scratch.empty(sources.shape, np.int32)
    for tile in tiles(len(sources), max(TILE_HITS // max(sources.shape[1], 1), 1)):
        result[tile] = rows.numbers(sources[tile])
    return result
