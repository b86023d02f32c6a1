"""Charts on a page are packed by their outlines, not by the boxes around them."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.unwrap.packing import pack


def covered(uv: np.ndarray) -> float:
    """Return the share of the page that triangles (n, 3, 2) cover."""
    first, second = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return 0.5 * float(np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum())


@pytest.mark.parametrize("count", [8, 72])
def test_triangles_lie_in_each_others_boxes(count: int) -> None:
    """A right triangle fills half of every box around it: with boxes apart no more than half is covered."""
    triangles = np.repeat([[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]], count, axis=0)
    assert covered(pack(triangles, np.arange(count), 256, None).uv.astype(np.float64)) > 0.5
