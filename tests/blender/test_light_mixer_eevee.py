"""EEVEE mixes light groups as Cycles does, frame by frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.blender.eevee import seen_in_eevee
from tests.blender.group_bake import EMISSION, GLOW, LAMP
from tests.blender.hand_bake import BASE

SCRIPT = """
import radiosity_addon
from tests.blender import group_bake
from radiosity_addon.blender.images.light_mixer import mixers, sliders_of
radiosity_addon.register()
group_bake.lit_plane()
group_bake.bake_groups()
group_bake.slide("Glow", 2.0, (1.0, 0.5, 0.0))
lamps = sliders_of(mixers()[0])[0].strength
for frame, value in ((1, 1.0), (11, 3.0)):
    lamps.default_value = value
    lamps.keyframe_insert("default_value", frame=frame)
bpy.context.scene.eevee.taa_render_samples = 4
for frame in (1, 11):
    bpy.context.scene.frame_set(frame)
    look()
"""


def test_eevee_follows_sliders_and_keyframes(tmp_path: Path) -> None:
    seen = seen_in_eevee(SCRIPT, tmp_path)
    glow = np.array([2.0, 1.0, 0.0])
    lamps = np.array([[1.0], [3.0]])
    expected = np.multiply(BASE, lamps * LAMP + glow * GLOW) + glow * EMISSION
    # EEVEE's pixels are half floats.
    np.testing.assert_allclose(seen, expected, rtol=2e-3, atol=1e-3)
