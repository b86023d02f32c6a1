"""The operator behind the button *Relight*."""

from __future__ import annotations

import time
from typing import Any

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..errors import RadiosityError
from . import kept_bakes, live_state, runtime
from .operators import TICK, redraw_sidebars


class RADIOSITY_OT_relight(bpy.types.Operator):
    """Light the bake anew by the strengths and colors that lamps, emission and world have now"""

    bl_idname = "radiosity.relight"
    bl_label = "Relight"
    bl_options = {"REGISTER", "UNDO"}

    # Blender evaluates annotations when it registers the class: no names of later imports.
    _job: Any = None  # the generator of run_relight
    _report: Any = None  # RelightReport once it is done
    _timer: bpy.types.Timer | None = None

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Offer it where a bake was kept."""
        if runtime.running.active:
            cls.poll_message_set("A bake is running; press Esc to cancel it")
            return False
        if context.scene is None or not kept_bakes.mark_of(context.scene):
            cls.poll_message_set("The scene shows no bake that was kept: bake with Keep for Relighting")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Light it anew at one go."""
        try:
            self._begin(context, patient=False)
            while not self._advance(float("inf")):
                pass
        except RadiosityError as error:
            return self._fail(context, error)
        except BaseException:
            self._end(context)
            raise
        return self._finish(context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Start; a timer carries it on."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        try:
            self._begin(context, patient=True)
        except RadiosityError as error:
            return self._fail(context, error)
        self._timer = context.window_manager.event_timer_add(TICK / 3, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Carry on for a tick, or cancel."""
        if event.type == "ESC" and event.value == "PRESS":
            self._end(context)
            self.report({"INFO"}, "Relighting cancelled; everything is as it was")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            if not self._advance(TICK):
                redraw_sidebars(context)
                return {"RUNNING_MODAL"}
        except RadiosityError as error:
            return self._fail(context, error)
        except BaseException:
            self._end(context)
            raise
        return self._finish(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator from outside: a window closes, or Blender quits."""
        self._end(context)

    def _begin(self, context: bpy.types.Context, patient: bool) -> None:
        from .relight import run_relight

        live_state.stop()
        self._report = None
        self._job = run_relight(context, patient)
        runtime.running.active = True
        runtime.running.stop = lambda: self._end(bpy.context)
        runtime.running.stage, runtime.running.fraction = "export", 0.0

    def _advance(self, seconds: float) -> bool:
        """Work for about so long; True once it is done."""
        until = time.perf_counter() + seconds
        while time.perf_counter() < until:
            try:
                progress = next(self._job)
            except StopIteration as done:
                self._report = done.value
                return True
            runtime.running.stage, runtime.running.fraction = progress.stage, progress.fraction
        return False

    def _finish(self, context: bpy.types.Context) -> set[str]:
        self._end(context)
        self.report({"INFO"}, rpt_("Relit in {:.2f} s").format(self._report.seconds))
        return {"FINISHED"}

    def _fail(self, context: bpy.types.Context, error: RadiosityError) -> set[str]:
        self._end(context)
        self.report({"ERROR"}, " ".join(str(error).split()))
        return {"CANCELLED"}

    def _end(self, context: bpy.types.Context) -> None:
        job, self._job = self._job, None
        try:
            if job is not None:
                job.close()
        finally:
            runtime.running.active, runtime.running.stop = False, None
            if self._timer is not None:
                context.window_manager.event_timer_remove(self._timer)
                self._timer = None
            redraw_sidebars(context)


CLASSES = (RADIOSITY_OT_relight,)
