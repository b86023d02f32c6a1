"""The strengths that a changed scene's sources have, if it differs from a kept bake's in nothing else."""

from __future__ import annotations

import numpy as np

from ...base import SceneError
from ...numerics import Array
from ...scene import BakeScene
from ..scene_diff import RELIGHTABLE, aligned, compare, scene_record
from .kept_bake import KeptBake

SAME_EMISSION = 1e-5
"""Emission that differs from what its material's strength says by no more than this part is as expected."""


def strengths_in(kept: KeptBake, bake_scene: BakeScene) -> Array:
    """Return (s, 3) the strengths that a kept bake's sources have in another export of its scene.

    A lamp that is not there any more, or hidden, has none; so has a world that is black.

    Raises SceneError if anything else differs; the message names it.
    """
    compare(kept.record, scene_record(bake_scene)).refuse_all_but(RELIGHTABLE)
    before, now, sources = kept.bake_scene.scene, bake_scene.scene, kept.sources
    lights = aligned(before.lights, now.lights)
    exitance = np.zeros((len(sources) - len(lights), 3))
    emits = sources.emitter >= 0
    np.maximum.at(exitance, sources.emitter[emits], now.emission[emits])
    lamps = np.array([light.strength for light in lights]).reshape(-1, 3)
    strengths = sources.checked(np.concatenate([lamps, exitance]))
    expected = sources.emission(before.emission, np.arange(len(now)), strengths)
    if np.abs(expected - now.emission).max(initial=0.0) > SAME_EMISSION * now.emission.max(initial=0.0):
        raise SceneError("emission has changed in more than its strength, or is new somewhere: bake again")
    return strengths
