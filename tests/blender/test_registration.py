"""Switching the extension on and off."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import bpy
import pytest

import radiosity_addon
from radiosity_addon.blender.command_line import host
from radiosity_addon.blender.settings.properties import settings_of
from radiosity_addon.options.bake_settings import BakeSettings
from tests.processes import run_python

ROOT = Path(__file__).resolve().parents[2]


OURS = str(["base", "blender", "files", "options", "publishing"])
"""The rooms that registering imports: those that need nothing but Python, and Blender's side."""


def traces() -> set[str]:
    """What of ours Blender knows at the moment."""
    known = {name for name in dir(bpy.types) if "radiosity" in name.lower()}
    known |= {f"ops.{name}" for name in dir(bpy.ops.radiosity)}
    known |= {
        f"{kind.__name__}.{name}"
        for kind in (bpy.types.Scene, bpy.types.Object)
        for name in vars(kind)
        if "radiosity" in name
    }
    return known


def test_register_adds_and_unregister_leaves_nothing() -> None:
    assert traces() == set()
    for _ in range(2):
        radiosity_addon.register()
        assert {"RADIOSITY_PT_main", "ops.bake", "ops.restore", "ops.add_cornell_box"} <= traces()
        assert bpy.context.scene.radiosity.output_folder == "//lightmaps/"
        radiosity_addon.unregister()
        assert traces() == set()


def test_registering_twice_is_once(registered: None) -> None:
    radiosity_addon.register()
    radiosity_addon.unregister()
    assert traces() == set()


def test_a_failure_half_way_takes_back_the_first_half(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise RuntimeError("no command today")

    monkeypatch.setattr(host, "register", fail)
    with pytest.raises(RuntimeError, match="no command today"):
        radiosity_addon.register()
    assert traces() == set()


def test_registering_imports_no_solver(tmp_path: Path) -> None:
    """In a process of its own, for here the tests have imported everything."""
    code = (
        "import sys, bpy, radiosity_addon\n"
        "before = set(sys.modules)\n"
        "radiosity_addon.register()\n"
        "new = set(sys.modules) - before\n"
        "heavy = {'embreex', 'xatlas', 'numpy', 'multiprocessing', 'concurrent'}\n"
        "print('heavy:', sorted(m for m in new if m.split('.')[0] in heavy))\n"
        "ours = {m.split('.')[1] for m in new if m.startswith('radiosity_addon.')}\n"
        "print('ours:', sorted(ours))\n"
    )
    done = run_python(code)
    # The exit code tells that Blender survived leaving with the extension registered.
    assert (done.returncode, done.stderr) == (0, "")
    lines = dict(line.split(": ", 1) for line in done.stdout.splitlines() if ": [" in line)
    assert lines == {"heavy": "[]", "ours": OURS}


def test_leaving_python_takes_out_what_was_registered() -> None:
    """The module bpy ends with Python, and in some versions crashes there while classes are registered."""
    code = (
        "import atexit, bpy, radiosity_addon\n"
        # Called last, for it was asked for first.
        "atexit.register(lambda: print('left:', hasattr(bpy.types, 'RADIOSITY_PT_main'), flush=True))\n"
        "radiosity_addon.register()\n"
        "print('there:', hasattr(bpy.types, 'RADIOSITY_PT_main'), flush=True)\n"
    )
    done = run_python(code)
    assert (done.returncode, done.stderr) == (0, "")
    assert [line for line in done.stdout.splitlines() if ": " in line] == ["there: True", "left: False"]


@pytest.mark.parametrize(
    "field",
    [field.name for field in fields(BakeSettings)],
)
def test_panel_and_command_line_have_the_same_defaults(field: str, registered: None) -> None:
    assert getattr(settings_of(bpy.context), field) == getattr(BakeSettings(), field)


def test_every_setting_has_a_tooltip(registered: None) -> None:
    properties = bpy.types.Scene.bl_rna.properties["radiosity"].fixed_type.properties
    for prop in properties:
        if prop.identifier not in {"rna_type", "name"}:
            assert prop.description, prop.identifier
        for item in getattr(prop, "enum_items", ()):
            assert item.description, (prop.identifier, item.identifier)
