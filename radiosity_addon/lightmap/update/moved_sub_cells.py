"""Cells of elements and of texels where something moved: what of them still stands, and sees the same."""

from __future__ import annotations

import numpy as np

from ...base import Progress
from ...solver.gather import UNNUMBERED, AimedRays, Before, GatheredHits
from ..transport import SubCellHits
from .moved_light import sub_cell_gains
from .previous import StandingHits


def kept_cells(standing: StandingHits, progress: Progress) -> list[SubCellHits]:
    """Return the cells that still stand, those of one kind together, with what their rays meet now."""
    found: list[SubCellHits] = []
    for of_kind in standing.previous.lit.transport.cells.links:
        number = standing.numbers(of_kind.rows)
        stays = number != UNNUMBERED
        sources = standing.numbers(of_kind.sources[stays])
        of_element = number[stays] < standing.table.first_cell
        gains = None if of_kind.gains is None else of_kind.gains.take(stays)
        assert of_element.all() or not of_element.any()  # links are of one kind
        tints = None if of_kind.tints is None else of_kind.tints[stays]
        kept = SubCellHits(bool(of_element.any()), number[stays], sources, gains, tints)
        if len(kept.number):
            found.append(kept)
    joined = SubCellHits.joined(found)
    return [_traced_again(hits, standing, part) for hits, part in progress.each(joined)]


def _traced_again(hits: SubCellHits, standing: StandingHits, progress: Progress) -> SubCellHits:
    """Trace again what is touched of the rays of cells, and of those to lamps."""
    table, previous = standing.table, standing.previous
    local, affected = table.local, previous.affected
    at, upright = table.footprints(hits.number, hits.of_element)
    if hits.of_element:
        widen = table.element_cells.radius(table.element_cell(hits.number))
    else:
        widen = affected.widen[table.texel_cells.texel_of(table.texel_cell(hits.number))]
    nowhere = np.zeros((0, 1, 3))
    # Cells speak for nobody: how close things are to them is not asked.
    unasked = np.full(len(hits.number), np.inf)
    gathered = GatheredHits(hits.sources, unasked, AimedRays.none(), hits.tints)
    earlier = Before(
        gathered,
        aimed_at=(nowhere, nowhere),
        moved=affected.traced(previous.local.caster),
        widen=widen,
        bright=np.zeros(local.elements.hierarchy.n_elements, dtype=bool),
        hosts=np.zeros(len(affected.moved), dtype=bool),
    )
    found = local.gather.again_at(at, upright, table.number, earlier, progress=progress.part(0.0, 0.6))
    part = progress.part(0.6, 1.0)
    gains = sub_cell_gains(hits, table, previous, np.asarray(at.points), widen, part)
    return SubCellHits(hits.of_element, hits.number, found.sources, gains, found.tints)
