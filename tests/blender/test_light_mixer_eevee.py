"""EEVEE mixes light groups as Cycles does, frame by frame: in a process of its own, which dies without GL."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.blender.group_bake import EMISSION, GLOW, LAMP
from tests.blender.hand_bake import BASE

ROOT = Path(__file__).resolve().parents[2]

_SCRIPT = """
import os, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import bpy
import radiosity_addon
from tests.blender import group_bake, hand_bake
from radiosity_addon.blender.images.light_mixer import mixers, sliders_of
bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
radiosity_addon.register()
group_bake.lit_plane()
group_bake.bake_groups()
group_bake.slide("Glow", 2.0, (1.0, 0.5, 0.0))
lamps = sliders_of(mixers()[0])[0].strength
for frame, value in ((1, 1.0), (11, 3.0)):
    lamps.default_value = value
    lamps.keyframe_insert("default_value", frame=frame)
bpy.context.scene.eevee.taa_render_samples = 4
engine = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0) else "BLENDER_EEVEE"
for frame in (1, 11):
    bpy.context.scene.frame_set(frame)
    print("seen", *hand_bake.seen_from_above(Path(sys.argv[2]), 8, engine)[4, 4])
sys.stdout.flush()
os._exit(0)
"""


def test_eevee_follows_sliders_and_keyframes(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT, str(ROOT), str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    if done.returncode in (134, 139, -6, -11):
        pytest.skip("EEVEE needs OpenGL, which this machine does not have")
    assert done.returncode == 0, done.stderr
    seen = [line.split()[1:] for line in done.stdout.splitlines() if line.startswith("seen ")]
    glow = np.array([2.0, 1.0, 0.0])
    lamps = np.array([[1.0], [3.0]])
    expected = np.multiply(BASE, lamps * LAMP + glow * GLOW) + glow * EMISSION
    # EEVEE's pixels are half floats.
    np.testing.assert_allclose(np.array(seen, dtype=float), expected, rtol=2e-3, atol=1e-3)
