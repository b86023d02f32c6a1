"""Tints of gather rays, as they are kept."""

from __future__ import annotations

import numpy as np

from radiosity_addon.rays.caster import Hits
from radiosity_addon.solver.gather.final_gather import MOST_TINT, tints_of


def test_tints_stay_finite() -> None:
    """Each of eleven painted panes triples the red of a ray that passes."""
    tint = np.array([[0.25, 1.0, 3.0**11]], dtype=np.float32)
    some = np.zeros(1)
    hits = Hits(some.astype(np.int32), np.zeros((1, 2)), some == 0, some, tint)
    np.testing.assert_array_equal(tints_of(hits), [[0.25, 1.0, MOST_TINT]])
