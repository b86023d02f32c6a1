"""Parts of leaves and cells of texels where something moved: what of them still stands, and sees the same."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base import Progress
from ...numerics import Array
from ...solver.gather import STALE, AimedRays, Before, Gathered, LightGains, LocalPass, Resolver
from ..lighting import HitNumbers, LightingRecord, PartHits, PartLinks
from .affected import AffectedTexels
from .moved_light import part_gains


def known_parts(
    links: Sequence[PartLinks], traced: LightingRecord, numbers: HitNumbers, now: Array
) -> list[PartHits]:
    """Return the parts that still stand, those of one kind together.

    Parameters
    ----------
    traced : LightingRecord
        How they were found.
    numbers : HitNumbers
        What hits are numbered by now, …
    now : (numbers,) int32
        … by what they were before; STALE for what does not stand any more.
    """
    kinds: dict[tuple[bool, int], list[PartHits]] = {}
    count = numbers.texel_count
    for some in links:
        part = now[traced.numbered(some.rows)]
        stays = part != STALE
        sources = renumbered(traced.numbered(some.sources[stays]), now)
        is_leaf = part[stays] < numbers.first_cell
        gains = None if some.gains is None else some.gains.take(stays)
        assert is_leaf.all() or not is_leaf.any()  # links are of one kind
        kept = PartHits(bool(is_leaf.any()), part[stays] - count, sources, gains)
        if len(kept.part):
            kinds.setdefault((kept.is_leaf, kept.rays), []).append(kept)
    return [_joined(of_kind) for of_kind in kinds.values()]


def _joined(parts: list[PartHits]) -> PartHits:
    gains = [some.gains for some in parts if some.gains is not None]
    return PartHits(
        parts[0].is_leaf,
        np.concatenate([some.part for some in parts]),
        np.concatenate([some.sources for some in parts]),
        LightGains.joined(gains),
    )


def renumbered(sources: Array, now: Array) -> Array:
    """Return sources of any shape by their numbers now; negative ones stay."""
    return np.asarray(np.where(sources >= 0, now[np.maximum(sources, 0)], sources))


def look_again(
    parts: PartHits,
    numbers: HitNumbers,
    before: LocalPass,
    affected: AffectedTexels,
    resolve: Resolver,
    progress: Progress,
) -> PartHits:
    """Trace again what is touched of the rays of parts, and of those to lamps."""
    local = numbers.local
    if parts.is_leaf:
        at = local.parts.footprints(parts.part)
        upright, widen = at.normals, local.parts.radius(parts.part)
    else:
        cell = numbers.cell(parts.part)
        at, upright = numbers.cells.footprints(cell), numbers.cells.upright(cell)
        widen = affected.widen[numbers.cells.texel_of(cell)]
    nowhere = np.zeros((0, 1, 3))
    # Parts speak for nobody: how close things are to them is not asked.
    unasked = np.full(len(parts.part), np.inf)
    gathered = Gathered(parts.sources, unasked, AimedRays.none())
    earlier = Before(
        gathered,
        aimed_at=(nowhere, nowhere),
        moved=affected.traced(before.caster),
        widen=widen,
        bright=np.zeros(local.hierarchy.n_elements, dtype=bool),
        hosts=np.zeros(len(affected.moved), dtype=bool),
    )
    found = local.regather(at, upright, resolve, earlier, progress=progress.part(0.0, 0.6))
    part = progress.part(0.6, 1.0)
    gains = part_gains(parts, numbers, before, affected.boxes, at.points, widen, part)
    return PartHits(parts.is_leaf, parts.part, found.sources, gains)
