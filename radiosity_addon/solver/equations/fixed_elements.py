"""A fixed set of elements, for methods that need all elements beforehand."""

from __future__ import annotations

import numpy as np

from ..hierarchy import Hierarchy


def subdivide_evenly(hierarchy: Hierarchy, count: int) -> None:
    """Split the largest leaves, generation by generation, until there are about `count`.

    Elements then differ in area by a factor of four at most, except where faces are smaller
    from the start. Faces below the mean area come on top of `count`: however many small
    triangles a scene has, its large ones are divided. Never splits beyond that.
    """
    area = hierarchy.area[hierarchy.leaves]
    # Elements that even a division into `count` would not split.
    small = int((area < area.sum() / max(count, 1)).sum())
    limit = count + small if len(area) > count else count
    while True:
        leaves = hierarchy.leaves
        room = (limit - len(leaves)) // 3
        if room <= 0:
            return
        area = hierarchy.area[leaves]
        # The largest generation: within a factor of two of the largest leaf.
        large = np.flatnonzero(area > 0.5 * area.max())
        if len(large) > room:
            # Part of a generation, evenly spread over the faces: better than stopping far below.
            large = large[np.arange(room) * len(large) // room]
            hierarchy.subdivide(leaves[large])
            return
        hierarchy.subdivide(leaves[large])
