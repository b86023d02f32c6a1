"""A bake without a solver: a result made by hand, to test what Blender is told to do with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from radiosity_addon.bake_scene import BakedObject, BakeResult, LightmapPage
from radiosity_addon.blender.export_sources import Export

SOLVER = {
    "elements": 8, "links": 12, "rays": 345, "iterations": 3, "residual": 1e-4,
    "power_W": {"emitted": 1.0, "absorbed": 0.75, "escaped": 0.25}, "closure_area_mean": 0.998,
}  # fmt: skip


def hand_result(export: Export, colors: Sequence[Sequence[float]] = ((0.25, 0.5, 0.75),)) -> BakeResult:
    """Give the baked objects random UVs and pages of one color each, dealt in turn."""
    rng = np.random.default_rng(1)
    baked = [
        BakedObject(target, rng.random((target.count, 3, 2), dtype=np.float32), i % len(colors))
        for i, target in enumerate(t for t in export.bake_scene.objects if t.bake)
    ]
    pages = [
        LightmapPage(
            np.broadcast_to(np.array(color, np.float32), (4, 8, 3)).copy(), np.ones((4, 8), bool)
        )
        for color in colors
    ]
    return BakeResult(tuple(pages), tuple(baked), SOLVER, (), {"solve": 0.5})
