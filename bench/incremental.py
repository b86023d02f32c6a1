"""The cost of baking again after one object moved, as parts of a bake: `python3 -m bench.incremental`.

Processor seconds, a thread. The same lightmap coordinates, resolution, quality and seed on both sides; errors
are between the two, next to those between full bakes of two seeds: over all texels, over those no farther
than 0.3 m from where the object stood or stands, and over its own.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from radiosity_addon.bake.pipeline import bake, bake_and_keep
from radiosity_addon.bake.rebaking import bake_moved
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import Scene
from tests.cornell import cornell_box
from tests.unit.texel_scenes import bake_scene

from .compare import say
from .report import context

T = TypeVar("T")

NEAR = 0.3
"""Texels no farther from the object's boxes count as near [m]."""

RESULTS = Path(__file__).parent / "results" / "incremental.json"


def box() -> tuple[BakeScene, str, Callable[[np.ndarray], np.ndarray]]:
    """The Cornell box, and its short block a quarter of a meter aside and turned by 15°."""
    scene = cornell_box()
    parts = bake_scene(scene, ("Walls", 10), ("Short Block", 10), ("Tall Block", 10), ("Lamp", 2))
    return parts, "Short Block", _placed((1.85, 0.0, 1.69), 15.0, 1, (0.25, 0.0, -0.2))


def office() -> tuple[BakeScene, str, Callable[[np.ndarray], np.ndarray]]:
    """The office, and one of its chairs half a meter aside and turned by 25°."""
    import bpy

    from radiosity_addon.blender.files.files import empty_scene
    from radiosity_addon.blender.scene_export.export import export_scene

    from .interior.office import build_office

    empty_scene()
    build_office()
    exported = export_scene(bpy.context, BakeSettings()).bake_scene
    chair = next(item for item in exported.objects if item.name == "Chair 2")
    center = exported.scene.triangles[chair.rows].mean(axis=(0, 1)) * (1.0, 1.0, 0.0)
    return exported, chair.name, _placed(center, 25.0, 2, (0.4, -0.25, 0.0))


SCENES = {"cornell": box, "office": office}


def measure(name: str, seeds: bool, **settings: Any) -> dict[str, Any]:
    """Bake a scene, move its object, bake again both ways, and return the costs."""
    scene, moved, place = SCENES[name]()
    chosen = BakeSettings(threads=1, **settings)
    (_, kept), keeping = _timed(lambda: bake_and_keep(scene, chosen))
    say(f"{name}: kept in {keeping:.1f} s")
    uv = kept.geometry.uv
    item = next(some for some in scene.objects if some.name == moved)
    now = replace(
        scene,
        scene=_with(scene.scene, item.rows, place),
        objects=tuple(replace(some, uv=uv[some.rows]) for some in scene.objects),
    )
    (found, after), seconds = _timed(lambda: bake_moved(kept, now))
    full, whole = _timed(lambda: bake(now, chosen))
    geometry = after.geometry
    own = (geometry.triangle >= item.first) & (geometry.triangle < item.first + item.count)
    corners = [some.triangles[item.rows].reshape(-1, 3) for some in (scene.scene, now.scene)]
    near = np.any(
        [
            ((geometry.position > of.min(axis=0) - NEAR) & (geometry.position < of.max(axis=0) + NEAR)).all(1)
            for of in corners
        ],
        axis=0,
    )
    where = {"all": np.ones(len(own), dtype=bool), "near": near, "own": own}
    figures: dict[str, Any] = {
        **settings,
        "moved": moved,
        "triangles": len(scene.scene),
        "texels": len(own),
        "kept_seconds": keeping,
        "full_seconds": whole,
        "seconds": seconds,
        "part": seconds / whole,
        "rays_part": after.solved.local.caster.rays / full.solver["rays"],
        "against_full": {part: _differs(found, full, rows) for part, rows in where.items()},
    }
    if seeds:
        other = bake(now, replace(chosen, seed=7))
        figures["two_seeds"] = {part: _differs(other, full, rows) for part, rows in where.items()}
    say(json.dumps(figures, indent=1))
    return figures


def _placed(
    about: Any, degrees: float, axis: int, by: tuple[float, float, float]
) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that turns vectors (…, 3) about an upright axis, and moves points."""
    angle = np.radians(degrees)
    one, other = (axis + 1) % 3, (axis + 2) % 3
    turn = np.eye(3)
    turn[one, one] = turn[other, other] = np.cos(angle)
    turn[one, other], turn[other, one] = -np.sin(angle), np.sin(angle)

    def place(vectors: np.ndarray, points: bool = True) -> np.ndarray:
        if not points:
            return np.asarray(vectors @ turn.T)
        return np.asarray((vectors - about) @ turn.T + about + np.asarray(by))

    return place


def _with(scene: Scene, rows: slice, place: Any) -> Scene:
    """Return a scene some of whose triangles are elsewhere."""
    triangles, normals = scene.triangles.copy(), scene.normals.copy()
    triangles[rows], normals[rows] = place(triangles[rows]), place(normals[rows], points=False)
    return Scene(
        triangles,
        scene.reflectance,
        scene.emission,
        scene.two_sided,
        scene.lights,
        normals,
        scene.images,
        scene.in_bounces,
        scene.in_shadows,
    )


def _differs(found: BakeResult, expected: BakeResult, rows: np.ndarray) -> dict[str, float]:
    """Return the RMS difference of some texels, relative to the mean of all, and the ratio of their means."""
    one, other = (
        np.concatenate([page.pixels[page.coverage] for page in result.pages]).astype(np.float64)
        for result in (found, expected)
    )
    error = np.sqrt(((one - other)[rows] ** 2).mean()) / other.mean()
    return {"relative_rmse": float(error), "mean_ratio": float(one[rows].mean() / other[rows].mean())}


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    started = time.process_time()
    result = work()
    return result, time.process_time() - started


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", choices=SCENES, action="append")
    parser.add_argument("--resolution", type=int, default=256)
    parser.add_argument("--quality", default="medium")
    parser.add_argument("--no-seeds", action="store_true", help="leave out the bake of another seed")
    options = parser.parse_args()
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {"case": "incremental", "runs": {}}
    for name in options.scene or SCENES:
        chosen = {"resolution": options.resolution, "quality": options.quality}
        results["runs"][name] = measure(name, not options.no_seeds, **chosen)
        results["context"] = context(1)
        RESULTS.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
