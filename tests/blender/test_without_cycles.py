"""Without the add-on Cycles, which evaluates materials, one line says what to do."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

BAKE = """
import bpy
import addon_utils
import radiosity_addon
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.base import SceneError
from radiosity_addon.options import BakeSettings

bpy.ops.wm.read_factory_settings()
addon_utils.disable("cycles")
try:
    export_scene(bpy.context, BakeSettings())
except SceneError as error:
    print("refused:", error, flush=True)
"""


def test_a_bake_without_cycles_is_refused_in_one_line() -> None:
    """In a process of its own: an add-on that is enabled again is not what it was."""
    run = subprocess.run(
        [sys.executable, "-c", BAKE], cwd=ROOT, capture_output=True, text=True, timeout=120, check=False
    )
    # Not the exit code: the module of 4.2 crashes when it ends without Cycles.
    assert "Traceback" not in run.stderr
    (line,) = (line for line in run.stdout.splitlines() if line.startswith("refused:"))
    assert "Cycles is disabled" in line
    assert "Preferences → Add-ons" in line
