"""Edits, undo and deletion between the steps of a job: what a second window may do meanwhile."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import bpy
import pytest

from radiosity_addon.bake.keep import KeepOptions
from radiosity_addon.base.errors import BakeError, RadiosityError
from radiosity_addon.blender.datablocks.bake_record import recorded_objects
from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.jobs import window_job
from radiosity_addon.blender.jobs.file_watch import guarded
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.blender.relight.relight_scene import run_relight
from radiosity_addon.blender.session.state import session
from radiosity_addon.options.bake_settings import BakeSettings

QUICK = BakeSettings(resolution=16, quality="sketch")


@pytest.fixture(autouse=True)
def box(registered: None) -> bpy.types.Scene:
    scene = build_cornell_box()
    textured("Floor")
    bpy.ops.ed.undo_push(message="Box")
    return scene


def textured(name: str) -> None:
    """Have an object's material vary, so that its evaluation by Cycles is among the steps."""
    tree = bpy.data.objects[name].data.materials[0].node_tree
    checker = tree.nodes.new("ShaderNodeTexChecker")
    shader = next(node for node in tree.nodes if node.type in {"BSDF_PRINCIPLED", "BSDF_DIFFUSE"})
    tree.links.new(checker.outputs["Color"], shader.inputs[0])


def blocks() -> list[str]:
    kinds = (
        "objects",
        "meshes",
        "materials",
        "images",
        "node_groups",
        "scenes",
        "cameras",
        "worlds",
        "lights",
    )
    return sorted(f"{kind}/{block.name}" for kind in kinds for block in getattr(bpy.data, kind))


def job(in_background: bool = False) -> Any:
    return guarded(run_bake(bpy.context, QUICK, None, in_background=in_background), bpy.context)


def advance(running: Any, to: str) -> None:
    """Take the steps of a job up to a moment; how many of the export there are is a matter of time."""
    begun = next(running)
    if to == "export":
        next(running)
        next(running)
    elif to == "worked":
        while begun.stage == "export":
            begun = next(running)
        next(running)
    elif to == "end":
        while begun.stage not in {"apply", "write"}:
            begun = next(running)


MOMENTS = [
    "begin",
    *(pytest.param(name, marks=pytest.mark.one_blender) for name in ("export", "worked")),
    "end",
]


def delete() -> None:
    bpy.data.objects.remove(bpy.data.objects["Tall Block"])


def delete_material() -> None:
    bpy.data.materials.remove(bpy.data.objects["Floor"].data.materials[0])


def rename() -> None:
    bpy.data.objects["Tall Block"].name = "Renamed"


def edit_mesh() -> None:
    mesh = bpy.data.objects["Tall Block"].data
    mesh.clear_geometry()
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])


def add() -> None:
    mesh = bpy.data.objects["Tall Block"].data
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Added", mesh))


def undo() -> None:
    bpy.ops.ed.undo_push(message="Something")
    bpy.ops.ed.undo()


EDITS: list[Callable[[], None]] = [delete, delete_material, rename, edit_mesh, add, undo]


@pytest.mark.parametrize("edit", EDITS)
@pytest.mark.parametrize("at", MOMENTS)
def test_between_any_two_steps_a_bake_survives_or_stops_and_leaves_nothing(
    edit: Callable[[], None], at: str
) -> None:
    running = job()
    advance(running, at)
    edit()
    before = blocks()
    try:
        for _ in running:
            pass
    except RadiosityError as error:
        message = str(error)
        assert message
        assert "\n" not in message
        assert blocks() == before
        assert not recorded_objects()
    else:
        assert recorded_objects()
        assert bpy.ops.radiosity.restore() == {"FINISHED"}
        assert set(blocks()) == set(before)


def test_an_edit_of_a_stand_in_during_a_second_bake_is_in_its_report() -> None:
    first, second = bpy.data.objects["Tall Block"], bpy.data.objects["Short Block"]
    second.data = first.data
    assert [*job()][-1]
    assert first.data != second.data
    running = job()
    advance(running, "worked")
    first.data.vertices[0].co.x += 0.01
    edited = first.data.vertices[0].co.x
    while True:
        try:
            next(running)
        except StopIteration as done:
            report = done.value
            break
    assert any("edited" in warning["message"] for warning in report.data["warnings"])
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert first.data == second.data
    assert first.data.vertices[0].co.x == edited


def test_an_undo_stops_a_bake_at_its_next_step() -> None:
    running = job()
    next(running)
    undo()
    with pytest.raises(BakeError, match="Undo"):
        next(running)
    assert next(running, None) is None


def test_another_file_stops_it() -> None:
    running = job()
    next(running)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with pytest.raises(BakeError, match="another file"):
        next(running)


def test_another_scene_stops_it() -> None:
    # The module has no window whose scene could be changed.
    window = SimpleNamespace(scene=bpy.context.scene)
    running = guarded(run_bake(bpy.context, QUICK, None), window)
    next(running)
    window.scene = bpy.data.scenes.new("Other")
    with pytest.raises(BakeError, match="scene"):
        next(running)


def test_no_handler_stays() -> None:
    handlers = bpy.app.handlers
    lists = (handlers.undo_post, handlers.redo_post, handlers.load_pre)
    before = [len(each) for each in lists]
    running = job()
    next(running)
    assert [len(each) for each in lists] == [count + 1 for count in before]
    running.close()
    assert [len(each) for each in lists] == before


@pytest.mark.one_blender
@pytest.mark.parametrize("edit", [delete, rename, edit_mesh, undo])
@pytest.mark.parametrize("at", MOMENTS)
def test_between_the_steps_of_a_relight_too(edit: Callable[[], None], at: str) -> None:
    for _ in run_bake(bpy.context, QUICK, None, keeping=KeepOptions()):
        pass
    lamp = next(obj for obj in bpy.data.objects if obj.type == "LIGHT")
    lamp.data.energy *= 2
    bpy.ops.ed.undo_push(message="Brighter")
    running = guarded(run_relight(bpy.context), bpy.context)
    advance(running, at)
    edit()
    before = blocks()
    with suppress(RadiosityError):
        for _ in running:
            pass
    assert blocks() == before


class Job(window_job.WindowJob):
    """A job of ten steps, each of which takes longer than one turn."""

    def __init__(self) -> None:
        self.steps = 0

    def _start(self, _context: object, _in_window: bool) -> Iterator[SimpleNamespace]:
        for number in range(10):
            self.steps += 1
            time.sleep(2 * window_job.TICK)
            yield SimpleNamespace(stage="solve", fraction=number / 10, expected=None)


def test_only_its_own_timer_carries_a_job_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Events of timers do not say whose they are, and others need theirs too."""
    timer, context = SimpleNamespace(time_duration=0.0), MagicMock()
    context.window_manager.event_timer_add.return_value = timer
    # The module bpy has no window.
    monkeypatch.setattr(window_job, "bpy", MagicMock(context=context, **{"app.background": False}))
    job, foreign = Job(), SimpleNamespace(type="TIMER", value="NOTHING")
    assert job.invoke(context, foreign) == {"RUNNING_MODAL"}
    for _ in range(5):
        assert job.modal(context, foreign) == {"PASS_THROUGH"}
    assert job.steps == 0
    timer.time_duration = 0.01
    # The other one's event may be the first of two that came at once: it is passed on then too.
    assert job.modal(context, foreign) == {"PASS_THROUGH"}
    assert job.modal(context, foreign) == {"PASS_THROUGH"}
    assert job.steps == 1
    of_a_region = SimpleNamespace(type="TIMERREGION", value="NOTHING")
    assert job.modal(context, of_a_region) == {"PASS_THROUGH"}
    job.cancel(context)
    context.window_manager.event_timer_remove.assert_called_once_with(timer)
    assert job.modal(context, foreign) == {"CANCELLED"}
    assert not session.running.active
