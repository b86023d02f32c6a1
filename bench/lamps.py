"""How a bake's cost grows with lamps: `python3 -m bench.lamps`.

Processor seconds of the office at draft with 10, 100 and 1,000 lamps of the same power together, and how far
each lightmap is from one that evaluates every lamp alone, with the same seed. `--keep` measures bakes that
can be relit: their size, and with `--relight` how far they are from full bakes, of lamps alone and of other
strengths.
"""

from __future__ import annotations

import argparse
import json
import resource
import tempfile
import time
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from radiosity_addon.bake import pipeline
from radiosity_addon.bake.relight.kept_bake import relight_pages
from radiosity_addon.bake.sidecar.sidecar import write_sidecar
from radiosity_addon.lights.light import Emitter
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene

from .compare import say

COUNTS = (10, 100, 1000)

OTHER_SEED = 7
"""Of the full bake that says how much noise there is."""


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


def measure_kept(lamps: int, detail: float, relit: bool, **settings: Any) -> dict[str, Any]:
    """Bake the office to be relit; if asked to, also relight it and compare it with full bakes."""
    scene, chosen = office(lamps, detail), BakeSettings(**settings)
    start = time.process_time()
    result, kept = pipeline.bake_and_keep(scene, chosen)
    figures: dict[str, Any] = {
        **settings,
        "lamps": lamps,
        "kept_processor_seconds": time.process_time() - start,
        "rays_per_texel": result.performance["rays_per_texel"],
        "kept_MB": kept.nbytes / 1e6,
        "peak_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }
    with tempfile.TemporaryDirectory() as folder:
        figures["sidecar_MB"] = write_sidecar(Path(folder) / "kept", kept, result, "bench") / 1e6
    say(json.dumps(figures))
    lit = [row for row, light in enumerate(kept.sources.lights) if isinstance(light, Emitter)]
    random = np.random.default_rng(1)
    parts = {f"lamp {lit[row]} alone": np.eye(len(lit))[row] for row in (4, 5)}
    parts["0 to 10 times"] = random.choice([0.0, 0.1, 1.0, 10.0], len(lit))
    for name, part in parts.items() if relit else ():
        strengths = kept.strengths.copy() if name.startswith("0") else np.zeros_like(kept.strengths)
        strengths[lit] = kept.strengths[lit] * part[:, None]
        start = time.process_time()
        found = relight_pages(kept, strengths)[0].pixels[..., :3].astype(float)
        seconds = time.process_time() - start
        changed = _with_strengths(
            scene, strengths, kept.sources.emission(scene.scene.emission, _every(scene), strengths)
        )
        full, _, _ = _baked(changed, chosen)
        other, _, _ = _baked(changed, replace(chosen, seed=OTHER_SEED))
        mean = float(full.mean())
        figures[name] = {
            "processor_seconds": seconds,
            "difference": float(np.sqrt(((found - full) ** 2).mean())) / mean,
            "two_seeds": float(np.sqrt(((other - full) ** 2).mean())) / mean,
            "mean_difference": float((found - full).mean()) / mean,
        }
        say(f"{name}: {json.dumps(figures[name])}")
    return figures


def _every(scene: BakeScene) -> np.ndarray:
    return np.arange(len(scene.scene))


def _with_strengths(scene: BakeScene, strengths: np.ndarray, emission: np.ndarray) -> BakeScene:
    """Return a scene whose lights have (s, 3) strengths."""
    changed = copy(scene.scene)
    changed.emission = emission
    names = ("power", "irradiance", "radiance")
    lights = zip(scene.scene.lights, strengths, strict=False)
    changed.lights = tuple(
        replace(light, **{next(name for name in names if hasattr(light, name)): own}) for light, own in lights
    )
    return replace(scene, scene=changed)


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
    parser.add_argument("--keep", action="store_true", help="measure bakes that can be relit instead")
    parser.add_argument("--relight", action="store_true", help="with --keep, compare them with full bakes")
    chosen = parser.parse_args()
    for lamps in chosen.lamps:
        settings = {"resolution": chosen.resolution, "quality": chosen.quality}
        if chosen.keep:
            measure_kept(lamps, chosen.detail, chosen.relight, **settings)
        else:
            measure(lamps, chosen.detail, chosen.apart, **settings)


if __name__ == "__main__":
    main()
