"""Cells of elements and of texels where something moved: what of them still stands, and sees the same."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base import Progress
from ...numerics import Array
from ...solver.gather import UNNUMBERED, AimedRays, Before, Gathered, LightGains, LocalPass
from ..transport import HitTable, SubCellHits, SubCellLinks, TableRows
from .affected import AffectedTexels
from .moved_light import sub_cell_gains


def known_sub_cells(
    links: Sequence[SubCellLinks], rows: TableRows, table: HitTable, number_now: Array
) -> list[SubCellHits]:
    """Return the cells that still stand, those of one kind together.

    rows: Of the table of radiosity that the links are of.
    table: What hits are numbered by now, …
    number_now (numbers,) int32: … by what they were before; UNNUMBERED for what does not stand any more.
    """
    kinds: dict[tuple[bool, int], list[SubCellHits]] = {}
    for of_kind in links:
        number = number_now[rows.numbers(of_kind.rows)]
        stays = number != UNNUMBERED
        sources = renumbered(rows.numbers(of_kind.sources[stays]), number_now)
        of_element = number[stays] < table.first_cell
        gains = None if of_kind.gains is None else of_kind.gains.take(stays)
        assert of_element.all() or not of_element.any()  # links are of one kind
        kept = SubCellHits(bool(of_element.any()), number[stays], sources, gains)
        if len(kept.number):
            kinds.setdefault((kept.of_element, kept.rays), []).append(kept)
    return [_joined(hits) for hits in kinds.values()]


def _joined(parts: list[SubCellHits]) -> SubCellHits:
    gains = [hits.gains for hits in parts if hits.gains is not None]
    return SubCellHits(
        parts[0].of_element,
        np.concatenate([hits.number for hits in parts]),
        np.concatenate([hits.sources for hits in parts]),
        LightGains.joined(gains),
    )


def renumbered(sources: Array, number_now: Array) -> Array:
    """Return sources of any shape by their numbers now; negative ones stay."""
    return np.asarray(np.where(sources >= 0, number_now[np.maximum(sources, 0)], sources))


def trace_again(
    hits: SubCellHits, table: HitTable, before: LocalPass, affected: AffectedTexels, progress: Progress
) -> SubCellHits:
    """Trace again what is touched of the rays of cells, and of those to lamps."""
    local = table.local
    at, upright = table.footprints(hits.number, hits.of_element)
    if hits.of_element:
        widen = local.elements.cells.radius(table.element_cell(hits.number))
    else:
        widen = affected.widen[table.texel_cells.texel_of(table.texel_cell(hits.number))]
    nowhere = np.zeros((0, 1, 3))
    # Cells speak for nobody: how close things are to them is not asked.
    unasked = np.full(len(hits.number), np.inf)
    gathered = Gathered(hits.sources, unasked, AimedRays.none())
    earlier = Before(
        gathered,
        aimed_at=(nowhere, nowhere),
        moved=affected.traced(before.caster),
        widen=widen,
        bright=np.zeros(local.elements.hierarchy.n_elements, dtype=bool),
        hosts=np.zeros(len(affected.moved), dtype=bool),
    )
    found = local.gather.again_at(at, upright, table.number, earlier, progress=progress.part(0.0, 0.6))
    part = progress.part(0.6, 1.0)
    gains = sub_cell_gains(hits, table, before, affected.boxes, at.points, widen, part)
    return SubCellHits(hits.of_element, hits.number, found.sources, gains)
