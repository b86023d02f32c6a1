"""The time to relight a kept bake, as parts of the bake: `python3 -m bench.relight`.

Processor seconds, a thread. Each line is a change of the lights: how far the result is from a full bake
of them, and how far apart two full bakes of different seeds are. Then the same through the panel's buttons
in Blender, export and files included, and how fast Live follows.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from radiosity_addon.bake.pipeline import bake, bake_and_keep
from radiosity_addon.bake.relight.kept_bake import KeptBake, relight_pages
from radiosity_addon.bake.relight.responses import Responses
from radiosity_addon.bake.sidecar.sidecar import read_sidecar, write_sidecar
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import Scene
from tests.cornell import cornell_box
from tests.relit_rooms import BAKED, CHANGED, lit_bake
from tests.unit.texel_scenes import bake_scene

from . import report
from .compare import say

T = TypeVar("T")

Baker = Callable[[np.ndarray], BakeScene]

ROOT = Path(__file__).resolve().parents[1]

DRAGGED = 20
"""Steps of a slider of which Live's latency is the median."""


def box(strengths: np.ndarray) -> BakeScene:
    """The Cornell box with a lamp of (1, 3) exitance [W/m²]."""
    scene = cornell_box()
    emission = scene.emission.copy()
    emission[-2:] = strengths
    return bake_scene(Scene(scene.triangles, scene.reflectance, emission), ("Box", len(scene)))


def measure(
    name: str, scene: Baker, strengths: list[tuple[str, np.ndarray]], **settings: Any
) -> dict[str, Any]:
    """Bake a scene with the first strengths, relight it with the others, and report the time."""
    say(name)
    chosen = BakeSettings(threads=1, **settings)
    _, plain = _timed(lambda: bake(scene(strengths[0][1]), chosen))
    (result, kept), seconds = _timed(lambda: bake_and_keep(scene(strengths[0][1]), chosen))
    found: dict[str, Any] = {
        "scene": name,
        "texels": len(kept.geometry),
        "bake_seconds": plain,
        "kept_bake_seconds": seconds,
        "memory_MB": kept.nbytes / 1e6,
        "changes": [],
    }
    say(f"bake {plain:.2f} s, kept {seconds:.2f} s and {kept.nbytes / 1e6:.0f} MB")
    found["sidecar"] = _sidecar(kept, result, scene(strengths[0][1]), found["texels"])
    rays = kept.solved.local.caster.rays
    for change, wanted in strengths:
        first, once = _timed(partial(relight_pages, kept, wanted))
        _, again = _timed(partial(relight_pages, kept, wanted))
        full = bake(scene(wanted), chosen).pages
        other = bake(scene(wanted), BakeSettings(threads=1, seed=7, **settings)).pages
        entry = {
            "change": change,
            "seconds": once,
            "part_of_bake": once / plain,
            "again_part_of_bake": again / plain,
            "error": _error(first, full),
            "error_of_another_seed": _error(other, full),
        }
        found["changes"].append(entry)
        say(
            f"{change}: {once:.3f} s, {once / plain:.1%} of the bake; again {again / plain:.1%}; "
            f"relRMSE {entry['error']:.3%}, of another seed {entry['error_of_another_seed']:.2%}"
        )
    found["rays"] = kept.solved.local.caster.rays - rays
    say(f"rays traced while relighting: {found['rays']}")
    found["response"] = _response(kept, strengths[0][1], result.pages)
    return found


def _sidecar(kept: KeptBake, result: Any, scene: BakeScene, texels: int) -> dict[str, float]:
    """Write and read the sidecar of a kept bake."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "lightmap.relight"
        started = time.process_time()
        size = write_sidecar(path, kept, result, "bench")
        written = time.process_time()
        read_sidecar(path).kept(scene)
        read = time.process_time()
    say(f"sidecar {size / 1e6:.1f} MB, {size / texels:.0f} bytes a texel, read in {read - written:.2f} s")
    return {
        "MB": size / 1e6,
        "bytes_a_texel": size / texels,
        "write_seconds": written - started,
        "read_seconds": read - written,
    }


def _response(kept: KeptBake, strengths: np.ndarray, pages: tuple[LightmapPage, ...]) -> dict[str, float]:
    """Find out what the first source adds, and sum it up for another strength."""
    responses = Responses(kept, strengths, pages)
    _, once = _timed(lambda: responses.find(0))
    wanted = strengths.copy()
    wanted[0] *= 1.5
    started = time.process_time()
    responses.pages(wanted)
    return {"seconds": once, "sum_seconds": time.process_time() - started}


def measure_panel(resolution: int, quality: str) -> dict[str, Any]:
    """Bake the bundled Cornell box in Blender, relight it with the button, and follow a slider."""
    import bpy

    import radiosity_addon
    from radiosity_addon.blender.files.cornell import build_cornell_box
    from radiosity_addon.blender.session.state import session

    say("Cornell box in Blender: the buttons, with export and files")
    radiosity_addon.register()
    with tempfile.TemporaryDirectory() as folder:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene = build_cornell_box()
        scene.radiosity.resolution, scene.radiosity.quality = resolution, quality
        scene.radiosity.threads = 1
        bpy.ops.wm.save_as_mainfile(filepath=str(Path(folder) / "box.blend"))
        lamp = next(obj.data for obj in scene.objects if obj.type == "LIGHT")
        scene.radiosity_relight.keep = False
        plain = _clocked(lambda: bpy.ops.radiosity.bake("EXEC_DEFAULT"))
        scene.radiosity_relight.keep = scene.radiosity_relight.sidecar = True
        kept = _clocked(lambda: bpy.ops.radiosity.bake("EXEC_DEFAULT"))
        lamp.energy *= 2.0
        lamp.color = (0.4, 0.7, 1.0)
        button = _clocked(lambda: bpy.ops.radiosity.relight("EXEC_DEFAULT"))
        session.kept_bakes.clear()
        from_sidecar = _clocked(lambda: bpy.ops.radiosity.relight("EXEC_DEFAULT"))
        bpy.context.window_manager.radiosity_live = True
        session.live.settle()
        latencies = []
        for _ in range(DRAGGED):
            lamp.energy *= 1.02
            started = time.perf_counter()
            bpy.context.view_layer.update()
            session.live.read()
            latencies.append(time.perf_counter() - started)
        session.stop_live()
    radiosity_addon.unregister()
    found = {
        "scene": "cornell",
        "bake_seconds": plain,
        "kept_bake_seconds": kept,
        "relight_seconds": button,
        "relight_part_of_bake": button / plain,
        "relight_from_sidecar_seconds": from_sidecar,
        "live_latency_seconds": float(np.median(latencies)),
        "live_latency_seconds_worst": max(latencies),
    }
    say(f"bake {plain:.2f} s, kept {kept:.2f} s; Relight {button:.3f} s, {button / plain:.1%}")
    say(f"from the sidecar {from_sidecar:.3f} s; Live follows within {1e3 * np.median(latencies):.1f} ms")
    return found


def _clocked(action: Callable[[], Any]) -> float:
    """Return the processor seconds that an action takes."""
    started = time.process_time()
    action()
    return time.process_time() - started


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    started = time.process_time()
    result = work()
    return result, time.process_time() - started


def _error(found: tuple[LightmapPage, ...], expected: tuple[LightmapPage, ...]) -> float:
    """Root mean square of the difference, relative to the mean, over covered texels."""
    one, other = (
        np.concatenate([page.pixels[page.coverage] for page in pages]).astype(np.float64)
        for pages in (found, expected)
    )
    return float(np.sqrt(((one - other) ** 2).mean()) / other.mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--resolution", type=int, default=256)
    parser.add_argument("--quality", default="medium")
    parser.add_argument("--output", type=Path, metavar="DIR", help="also write relight.json there")
    options = parser.parse_args()
    settings = {"resolution": options.resolution, "quality": options.quality}
    white = np.array([(30.0, 22.0, 12.0)])
    colors = [("the same", white), ("another color", np.array([(5.0, 40.0, 30.0)]))]
    lamp_on = BAKED.copy()
    lamp_on[1] = 30.0
    changes = [("the same", BAKED), ("dark lamp on", lamp_on), ("all changed", CHANGED)]
    alone = [
        (f"source {row} alone", np.where(np.arange(6)[:, None] == row, lamp_on, 0.0)) for row in (0, 1, 3)
    ]
    results = {
        "case": "relight",
        **settings,
        "scenes": [
            measure("Cornell box", box, colors, **settings),
            measure("room of all kinds of light", lit_bake, changes + alone, **settings),
        ],
        "panel": measure_panel(options.resolution, options.quality),
        "context": report.context(1),
    }
    if options.output is not None:
        report.write(results, options.output)


if __name__ == "__main__":
    main()
