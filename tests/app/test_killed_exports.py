"""Exports that are killed: what an earlier one wrote stays or can be put back, and the next one is whole."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import bpy
import pytest

import radiosity_addon
from radiosity_addon.files import LISTED, is_as_written, read_report
from tests.reliability.folders import leftovers

from .conftest import ROOT, build_room
from .test_exports import files_in

IN_PANEL = """
import bpy, radiosity_addon
radiosity_addon.register()
bpy.ops.wm.open_mainfile(filepath={file!r})
bpy.context.scene.radiosity.export_web = {web}
bpy.ops.radiosity.export()
"""

ON_COMMAND_LINE = """
import sys
from radiosity_addon.blender.command_line.main import main
code = main(["export", {file!r}, "--forms", "{forms}", "--quiet"])
assert code == 0, code
"""


class Exporter:
    """Exports a bake in processes of their own.

    place: Where the export goes.
    """

    def __init__(self, place: Path, program: Callable[[bool], str]) -> None:
        self.place, self._program = place, program

    def run(self, web: bool, hook: str = "") -> int:
        """Export with the viewer, or without; returns the code of the process."""
        # Blender 4.2 as a module may crash at exit.
        code = f"import bpy, os\n{hook}\n{self._program(web)}\nos._exit(0)"
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
            start_new_session=True,
        )
        assert done.returncode in (0, -9), done.stdout + done.stderr
        return done.returncode

    def killed(self, call: int) -> bool:
        """Kill an export before a call that concerns its folder; False if it ended before."""
        hook = f"from tests.reliability.hooks import kill_at; kill_at({call}, {str(self.place)!r})"
        return self.run(True, hook) != 0


# The command line's export takes the same steps on disk.
@pytest.fixture(params=[pytest.param("command line", marks=pytest.mark.full), "panel"])
def exporter(request: pytest.FixtureRequest, tmp_path: Path) -> Exporter:
    """Of a small room."""
    if request.param == "command line":
        folder = Path(shutil.copytree(request.getfixturevalue("baked").folder, tmp_path / "out"))
        return Exporter(
            folder / "export",
            lambda web: ON_COMMAND_LINE.format(file=str(folder), forms="glb,web" if web else "glb"),
        )
    radiosity_addon.register()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    build_room()
    file = tmp_path / "room" / "room.blend"
    file.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.quality, settings.export_glb = 16, "sketch", True
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.ops.wm.save_mainfile()
    radiosity_addon.unregister()
    return Exporter(
        file.parent / "lightmaps" / "room_Scene_export", lambda web: IN_PANEL.format(file=str(file), web=web)
    )


def test_an_export_that_is_killed_leaves_the_earlier_one(exporter: Exporter) -> None:
    """Killed at moments from its first call to its last; the first kill leaves nothing: nothing was there."""
    assert exporter.killed(8)
    assert not files_of(exporter.place)
    assert exporter.run(web=False) == 0
    earlier = files_of(exporter.place)
    call, kills = 5, 0
    while exporter.killed(call):
        kills += 1
        here = files_of(exporter.place)
        assert {name: here.get(name) for name in earlier} == earlier or recoverable(exporter.place, earlier)
        call = call * 3 // 2 + 1
    assert kills >= 4
    assert exporter.run(web=True) == 0
    listed = read_report(next(exporter.place.glob("*report.json")))[LISTED]
    assert listed.keys() | {"report.json"} == files_of(exporter.place).keys()
    assert all(is_as_written(exporter.place / name, entry) for name, entry in listed.items())
    assert not leftovers(exporter.place, exporter.place.parent)
    assert files_of(exporter.place).keys() > earlier.keys()


def files_of(folder: Path) -> dict[str, bytes]:
    """The files that users see in a folder."""
    found = files_in(folder) if folder.is_dir() else {}
    return {
        name: data for name, data in found.items() if not any(p.startswith(".") for p in Path(name).parts)
    }


def recoverable(folder: Path, earlier: dict[str, bytes]) -> bool:
    """Whether all of an earlier export is still there, if aside."""
    here = {path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    return set(earlier.values()) <= here
