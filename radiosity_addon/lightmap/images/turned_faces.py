"""Objects lit from behind only: lightmaps hold the light on fronts, so theirs are black.

A wall whose normals point out of its room looks right in every render, as both sides of a surface
show, and black once it is baked. Somebody who does not know that will look for a leak.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ...base import BakeWarning
from ...numerics import Array
from ...scene import BakeObject

DARK = 0.02
"""A front that gets less than this part of its back's light is dark, …"""

SEEN = 0.1
"""… if the back gets at least this part of the mean light of lit sides."""

MAX_TURNED_SHARE = 0.1
"""Objects are warned of where more than this part of their area is like that: walls often are one object,
and closed ones, which are dark inside, never are."""


def turned_away(
    objects: Iterable[BakeObject], areas: Array, fronts: Array, backs: Array
) -> Iterator[BakeWarning]:
    """Yield a warning for each object with a large area lit from behind.

    objects: Those that get lightmaps.
    areas (t,) [m²].
    fronts, backs (t, 3) [W/m²]: Mean irradiance on both sides of every triangle.
    """
    front, back = fronts.max(axis=1), backs.max(axis=1)
    lit = np.maximum(front, back)
    where = lit > 0
    if not areas[where].any():
        return
    mean = float(areas[where] @ lit[where] / areas[where].sum())
    turned = (front < DARK * back) & (back > SEEN * mean)
    for item in objects:
        area = areas[item.rows]
        share = float(area @ turned[item.rows]) / max(float(area.sum()), 1e-300)
        if share > MAX_TURNED_SHARE:
            yield BakeWarning(
                item.name,
                f"object '{item.name}' is lit from behind only on {share:.0%} of its surface: normals point "
                "away from the light, so its lightmap is dark there; flip them (Mesh → Normals → Flip) if "
                "that side should be visible",
            )
