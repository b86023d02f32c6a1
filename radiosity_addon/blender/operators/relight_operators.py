"""The operator behind the button *Relight*."""

from __future__ import annotations

from typing import Any

import bpy

from ..jobs.window_job import WindowJob
from ..relight import kept_bakes
from ..relight.kept_sidecars import can_relight
from ..session.state import session


class RADIOSITY_OT_relight(WindowJob, bpy.types.Operator):
    """Light the bake anew by the strengths and colors that lamps, emission and world have now"""

    bl_idname = "radiosity.relight"
    bl_label = "Relight"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Offer it where a bake was kept."""
        if session.running.active:
            cls.poll_message_set("A bake is running; press Esc to cancel it")
            return False
        if context.scene is None or not kept_bakes.mark_of(context.scene):
            cls.poll_message_set("The scene shows no bake that was kept: bake with Keep for Relighting")
            return False
        if not can_relight(context.scene):
            cls.poll_message_set("The bake is no longer in memory, and has no sidecar of its own: bake again")
            return False
        return True

    def _start(self, context: bpy.types.Context, in_window: bool) -> Any:
        from ..relight.relight_scene import run_relight

        session.stop_live()
        return run_relight(context, in_background=in_window)

    def _succeeded(self, _context: bpy.types.Context, _in_window: bool) -> None:
        self.report({"INFO"}, f"Relit in {self._report.seconds:.2f} s")


CLASSES = (RADIOSITY_OT_relight,)
