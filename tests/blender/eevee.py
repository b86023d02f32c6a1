"""EEVEE in a process of its own, which dies where there is no OpenGL."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.processes import run_python

START = """
import os, sys
from pathlib import Path
import bpy
from tests.blender import hand_bake
bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
engine = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0) else "BLENDER_EEVEE"
def look(samples=1):
    # All that is seen has one color; transparency is dithered.
    bpy.context.scene.eevee.taa_render_samples = samples
    print("seen", *hand_bake.seen_from_above(Path(sys.argv[1]), 8, engine)[4, 4])
"""

END = """
sys.stdout.flush()
os._exit(0)
"""


def seen_in_eevee(script: str, folder: Path) -> np.ndarray:
    """Return (n, 3) what a script saw from above each time it called `look`; skips without OpenGL."""
    done = run_python(START + script + END, folder, timeout=300)
    if done.returncode in (134, 139, -6, -11):
        pytest.skip("EEVEE needs OpenGL, which this machine does not have")
    assert done.returncode == 0, done.stderr
    return np.array(
        [line.split()[1:] for line in done.stdout.splitlines() if line.startswith("seen ")], dtype=float
    )
