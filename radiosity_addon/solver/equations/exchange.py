"""Exchange areas: one number for each unordered pair of elements.

A_i F_ij V_ij is the same seen from either side (handout (3.30)), so it is computed from one
side only, always the same one, with rays of its own number. Whoever asks, for a matrix, a
column of it or a link, gets the same bits: that is what makes the methods agree exactly.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ...numerics import Array, fill_chunks
from ...rays import RayCaster
from ..hierarchy import Hierarchy
from ..links import element_factors, pair_visibility

CHUNK = 1 << 15
"""Pairs measured at once; their samples take about 100 MB."""


def exchange_areas(
    hierarchy: Hierarchy, caster: RayCaster, one: Array, other: Array, seed: int, threads: int = 0
) -> Array:
    """Return A_i F_ij V_ij of pairs of elements, the same for (i, j) and (j, i).

    one, other (n,) int: Elements; an element and itself exchange nothing, being flat.
    seed: Places the rays, together with the pair's own numbers.
    threads: 0 means all cores; the result does not depend on it.
    Returns exchange (n,) [m²]: The form factor is F_ij = exchange / A_i (handout (3.27)).
    """
    one, other = np.asarray(one), np.asarray(other)
    exchange = np.empty(len(one))
    # The smaller side receives: cubature over it converges faster.
    area_one, area_other = hierarchy.area[one], hierarchy.area[other]
    swap = (area_other < area_one) | ((area_other == area_one) & (other < one))
    receiver, source = np.where(swap, other, one), np.where(swap, one, other)
    fill_chunks(
        partial(_exchange, hierarchy, caster, receiver, source, seed), exchange, len(one), CHUNK, threads
    )
    return exchange


def _exchange(
    hierarchy: Hierarchy, caster: RayCaster, receiver: Array, source: Array, seed: int, rows: slice
) -> Array:
    receiver, source = receiver[rows], source[rows]
    factor, exchange = element_factors(hierarchy, receiver, source), np.zeros(len(receiver))
    seen = np.flatnonzero(factor > 0)
    receiver, source = receiver[seen], hierarchy.n_clusters + source[seen]
    visibility = pair_visibility(hierarchy, caster, receiver, source, seed)
    exchange[seen] = hierarchy.area[receiver] * factor[seen] * visibility
    return exchange
