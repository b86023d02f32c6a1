"""Bakes too large for the memory limit are refused before any work, wherever they are started."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import pytest

from radiosity_addon.blender.command_line.verbs import registered
from radiosity_addon.blender.jobs import job
from radiosity_addon.blender.jobs.inspection import ERROR, inspect
from radiosity_addon.options.bake_settings import BakeSettings

Run = Callable[..., object]


def test_the_command_line_refuses_with_the_figure(
    run: Run, room: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def exported(*_: object, **__: object) -> None:
        raise AssertionError("the scene was exported")

    monkeypatch.setattr(job, "export_steps", exported)
    done = run("bake", room, "--output", tmp_path / "out", "--resolution", 16384)
    assert done.code == 2
    assert len(done.err.splitlines()) == 1
    assert "GiB" in done.err
    assert "limit of 4" in done.err
    assert not (tmp_path / "out").exists()


def test_the_check_says_so_and_ends_with_an_error(run: Run, room: Path) -> None:
    done = run("bake", room, "--check", "--resolution", 16384)
    assert done.code == 1
    assert "memory limit of 4" in done.out


def test_the_panel_refuses_with_the_figure(room: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(room))
    with registered():
        group = bpy.context.scene.radiosity
        group.size_mode, group.resolution = "resolution", 16384
        found = inspect(bpy.context, BakeSettings(resolution=16384), None)
        assert any(each.level == ERROR and "memory limit" in each.message for each in found.findings)
        with pytest.raises(RuntimeError, match=r"GiB.*memory limit of 4"):
            bpy.ops.radiosity.bake()
