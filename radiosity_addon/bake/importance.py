"""How dense the texels of objects are that reach far beyond the rest of the scene.

Texels are as dense everywhere, unless an object says otherwise. But a ground disc 200 m wide around a house
would take nine tenths of the page, for places that nobody is near to. Where one object would take more than
all others together, only the part of it that lies among them counts; unless it encloses them, as a room does,
or they are too few, and too simple, to say where the scene is.
Neither a camera nor a lamp has a say: moving them changes no layout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base import BakeWarning
from ..numerics import Array
from ..options import BakeSettings
from ..scene import BakeObject, BakeScene

AMONG = 0.25
"""The box around all other objects is grown by this part of its diagonal on all sides."""

ENCLOSED = 0.01
"""Parts of the diagonal by which the others may stick out of an object that encloses them."""

OTHERS = 8
"""So many other objects are a scene, …"""

DETAIL = 200, 50.0
"""… or fewer, a house in one piece, that have as many triangles, and many times those of the large object; a
pebble on a floor is not."""

LEAST_SCALE = 0.125
"""An object is never thinned out further, …"""

LEAST_SHARE, LEAST_SHARE_OF_FEW = 0.25, 0.5
"""… nor given less than this part of the page, if it would take more by its surface: next to a scene, and
next to fewer objects."""

MOST_SHARE_OF_FEW = 0.8
"""Next to fewer objects it is thinned out only if it would take more of the page."""

MARKED = 0.5
"""An object is thinned out only if the part of it that counts is less than this."""


@dataclass(frozen=True)
class Extent:
    """An object's box (2, 3) [m], its surface [m²], whether its density is free, its number of triangles."""

    box: Array
    surface: float
    free: bool
    triangles: int = 0


def justified_scales(extents: Sequence[Extent]) -> list[float]:
    """Return a factor for each object's texels per meter: 1, or less for what is thinned out."""
    scales = [1.0] * len(extents)
    if not extents:
        return scales
    boxes = np.array([extent.box for extent in extents])
    surface = np.array([extent.surface for extent in extents])
    largest = int(surface.argmax())
    others = (surface > 0) & (np.arange(len(extents)) != largest)
    rest = float(surface[others].sum())
    share = rest / max(rest + float(surface[largest]), 1e-300)
    few = int(others.sum()) < OTHERS
    if not extents[largest].free or not others.any():
        return scales
    if share >= (1.0 - MOST_SHARE_OF_FEW if few else 0.5) or (few and not _detailed(extents, largest)):
        return scales
    low, high = boxes[others, 0].min(axis=0), boxes[others, 1].max(axis=0)
    diagonal = float(np.linalg.norm(high - low))
    box, slack = boxes[largest], ENCLOSED * diagonal
    if (box[0] <= low + slack).all() and (box[1] >= high - slack).all():
        return scales
    margin = AMONG * diagonal
    part = _part_within(box, np.stack([low - margin, high + margin]))
    if part < MARKED:
        least_share = LEAST_SHARE_OF_FEW if few else LEAST_SHARE
        least = least_share / (1.0 - least_share) * rest / surface[largest]
        scales[largest] = float(np.sqrt(min(max(part, least, LEAST_SCALE**2), 1.0)))
    return scales


def _detailed(extents: Sequence[Extent], largest: int) -> bool:
    """Return whether the others have far more triangles than the largest object."""
    rest = sum(extent.triangles for extent in extents) - extents[largest].triangles
    return rest >= max(DETAIL[0], DETAIL[1] * extents[largest].triangles)


def _part_within(box: Array, other: Array) -> float:
    """Return the part of a box that is within another one."""
    overlap = np.minimum(box[1], other[1]) - np.maximum(box[0], other[0])
    size = box[1] - box[0]
    wide = size > 1e-6 * max(float(size.max()), 1e-300)
    return float(np.clip(overlap[wide] / size[wide], 0.0, 1.0).prod())


def may_thin_out(settings: BakeSettings) -> bool:
    """Return whether objects share pages whose size is given, and so take texels from each other."""
    return settings.texel_density is None and settings.atlas == "shared"


def scales_of(bake_scene: BakeScene, baked: Sequence[BakeObject], settings: BakeSettings) -> list[float]:
    """Return `justified_scales` of objects to bake; a given density and an object's own scale hold."""
    if not may_thin_out(settings):
        return [item.thinning for item in baked]
    areas = bake_scene.scene.areas
    return justified_scales(
        [
            Extent(
                _box(bake_scene.scene.triangles[item.rows][item.lit]),
                float(areas[item.rows][item.lit].sum()) * item.texel_scale**2,
                item.uv is None and item.texel_scale == 1.0,
                int(item.lit.sum()),
            )
            for item in baked
        ]
    )


def thinned_out(names: Sequence[str], scales: Sequence[float], texels: Sequence[float]) -> list[BakeWarning]:
    """Name the objects that got fewer texels, with the scale that was used and the share they still take.

    texels: Of each, in any unit.
    """
    total = max(sum(texels), 1e-300)
    return [
        BakeWarning(
            name,
            f"object '{name}' reaches far beyond the others and would take most texels: it gets a Texel "
            f"Scale of {scale:.2g} and about {own / total:.0%} of the texels. Cut it into pieces if it is "
            "also seen from near; a Texel Scale other than 1, or a texel density, overrides this",
        )
        for name, scale, own in zip(names, scales, texels, strict=True)
        if scale < 1.0
    ]


def _box(triangles: Array) -> Array:
    corners = triangles.reshape(-1, 3)
    return np.stack([corners.min(axis=0), corners.max(axis=0)])
