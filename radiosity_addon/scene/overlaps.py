"""Coincident surfaces: limits what an element sends and sees.

Of coplanar surfaces in one place one counts (`layers.py`). Where others are too close for rays to
determine which is in front, both are seen, ΣFV becomes 2, and light would grow without end. So an element
sends only the share 1 / ΣFV of its radiosity: in matrix methods, shooting and two-level alike, so that they
still agree. Assemblies that are not reciprocal scale the light that an element receives.
"""

from __future__ import annotations

import numpy as np

from ..numerics import Array

OVERLAP = 1.1
"""ΣFV above this is not caused by rounding or few rays: a surface is counted twice."""


def shares(sums: Array, limit: float = OVERLAP) -> Array:
    """Return (n,) the share of its light that each element exchanges: 1 / ΣFV above `limit`, else 1.

    sums (n,): ΣFV of each element.
    """
    over = sums > limit
    return np.where(over, 1.0 / np.where(over, sums, 1.0), 1.0)


def arriving(exchange: Array, opacity: Array) -> Array:
    """Return (n,) Σ_j T_ij α_j [m²]: the part of each row's exchange that meets an existing surface.

    exchange (n, m): Exchange areas T.
    opacity (m,): α of each column's surface: a link sees all of a surface's area, holes included.
    """
    if (opacity == 1.0).all():
        return np.asarray(exchange.sum(axis=1))
    return np.asarray(exchange @ opacity)
