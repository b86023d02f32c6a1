"""How a bake's cost grows with lamps: `python3 -m bench.lamps`.

Processor seconds of the office at draft with 10, 100 and 1,000 lamps of the same power together, and how far
each lightmap is from one that evaluates every lamp alone, with the same seed.
"""

from __future__ import annotations

import argparse
import json
import time
from typing import Any

import numpy as np

from radiosity_addon.bake import pipeline
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene

from .compare import say

COUNTS = (10, 100, 1000)


def office(lamps: int, detail: float) -> BakeScene:
    import bpy

    from radiosity_addon.blender.files.files import empty_scene
    from radiosity_addon.blender.scene_export.export import export_scene

    from .interior.office import build_office

    empty_scene()
    build_office(detail, ceiling_lamps=lamps)
    return export_scene(bpy.context, BakeSettings()).bake_scene


def measure(lamps: int, detail: float, apart: bool, **settings: Any) -> dict[str, Any]:
    """Bake the office with so many lamps; if asked to, also every lamp apart."""
    scene = office(lamps, detail)
    pixels, seconds, rays = _baked(scene, BakeSettings(**settings))
    figures = {**settings, "lamps": lamps, "processor_seconds": seconds, "rays_per_texel": rays}
    if apart:
        grouping, pipeline.LAMPS_PER_RAY = pipeline.LAMPS_PER_RAY, lamps
        exact, figures["processor_seconds_apart"], figures["rays_per_texel_apart"] = _baked(
            scene, BakeSettings(**settings)
        )
        pipeline.LAMPS_PER_RAY = grouping
        mean = float(exact.mean())
        figures["difference"] = float(np.sqrt(((pixels - exact) ** 2).mean())) / mean
        figures["mean_difference"] = float((pixels - exact).mean()) / mean
    say(json.dumps(figures))
    return figures


def _baked(scene: BakeScene, settings: BakeSettings) -> tuple[np.ndarray, float, float]:
    start = time.process_time()
    result = pipeline.bake(scene, settings)
    seconds = time.process_time() - start
    return result.pages[0].pixels[..., :3].astype(float), seconds, result.performance["rays_per_texel"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--resolution", type=int, default=256)
    parser.add_argument("--quality", default="draft")
    parser.add_argument("--lamps", type=int, nargs="+", default=COUNTS)
    parser.add_argument("--detail", type=float, default=1.0)
    parser.add_argument(
        "--apart", action="store_true", help="also bake with every lamp alone, which takes minutes"
    )
    chosen = parser.parse_args()
    for lamps in chosen.lamps:
        settings = {"resolution": chosen.resolution, "quality": chosen.quality}
        measure(lamps, chosen.detail, chosen.apart, **settings)


if __name__ == "__main__":
    main()
