"""How long lighting a kept bake anew takes, in parts of the bake: `python3 -m bench.relight`.

Processor seconds, a thread. Each line is a change of the lights: how far the result is from a full bake
of them, and how far apart two full bakes of different seeds are.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Generator
from typing import Any, TypeVar

import numpy as np

from radiosity_addon.bake_scene import BakeScene, LightmapPage
from radiosity_addon.pipeline import bake, bake_and_keep
from radiosity_addon.relighting import relight
from radiosity_addon.settings import BakeSettings
from radiosity_addon.solver import Scene
from radiosity_addon.solver.steps import drain
from tests.cornell import cornell_box
from tests.relit_rooms import BAKED, CHANGED, lit_bake
from tests.unit.texel_scenes import bake_scene

from .compare import say

T = TypeVar("T")

Baker = Callable[[np.ndarray], BakeScene]


def box(strengths: np.ndarray) -> BakeScene:
    """The Cornell box with a lamp of (1, 3) exitance [W/m²]."""
    scene = cornell_box()
    emission = scene.emission.copy()
    emission[-2:] = strengths
    return bake_scene(Scene(scene.triangles, scene.reflectance, emission), ("Box", len(scene)))


def measure(scene: Baker, strengths: list[tuple[str, np.ndarray]], **settings: Any) -> None:
    """Bake a scene of the first strengths, light it anew by the others, and say what that took."""
    chosen = BakeSettings(threads=1, **settings)
    _, plain = _timed(bake(scene(strengths[0][1]), chosen))
    (_, kept), seconds = _timed(bake_and_keep(scene(strengths[0][1]), chosen))
    say(f"bake {plain:.2f} s, kept {seconds:.2f} s and {kept.nbytes / 1e6:.0f} MB")
    rays = kept.solved.local.caster.rays
    for name, wanted in strengths:
        first, once = _timed(relight(kept, wanted))
        _, again = _timed(relight(kept, wanted))
        full = drain(bake(scene(wanted), chosen)).pages
        other = drain(bake(scene(wanted), BakeSettings(threads=1, seed=7, **settings))).pages
        say(
            f"{name}: {once:.3f} s, {once / plain:.1%} of the bake; again {again / plain:.1%}; "
            f"relRMSE {_error(first, full):.3%}, of another seed {_error(other, full):.2%}"
        )
    say(f"rays traced while lighting anew: {kept.solved.local.caster.rays - rays}")


def _timed(steps: Generator[Any, None, T]) -> tuple[T, float]:
    started = time.process_time()
    result = drain(steps)
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
    options = parser.parse_args()
    settings = {"resolution": options.resolution, "quality": options.quality}
    say("Cornell box")
    white = np.array([(30.0, 22.0, 12.0)])
    measure(box, [("the same", white), ("another colour", np.array([(5.0, 40.0, 30.0)]))], **settings)
    say("room of all kinds of light")
    lamp_on = BAKED.copy()
    lamp_on[1] = 30.0
    changes = [("the same", BAKED), ("dark lamp on", lamp_on), ("all changed", CHANGED)]
    alone = [
        (f"source {row} alone", np.where(np.arange(6)[:, None] == row, lamp_on, 0.0)) for row in (0, 1, 3)
    ]
    measure(lit_bake, changes + alone, **settings)


if __name__ == "__main__":
    main()
