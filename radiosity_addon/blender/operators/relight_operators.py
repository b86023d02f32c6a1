"""The operator behind the button *Relight*."""

from __future__ import annotations

from typing import Any

import bpy

from ..jobs.window_job import WindowJob
from ..session.state import session
from .export_operators import warn_of_outdated
from .polls import Conditional, can_relight, no_bake_runs


class RADIOSITY_OT_relight(Conditional, WindowJob, bpy.types.Operator):
    """Update the bake for changed colors and strengths of lamps, emission and world, without tracing rays"""

    bl_idname = "radiosity.relight"
    bl_label = "Relight"
    bl_options = {"REGISTER", "UNDO"}

    conditions = (no_bake_runs, can_relight)

    def _start(self, context: bpy.types.Context, in_window: bool) -> Any:
        from ..relight.relight_scene import run_relight

        session.stop_live()
        return run_relight(context, in_background=in_window)

    def _succeeded(self, context: bpy.types.Context, _in_window: bool) -> None:
        relit = f"Relit in {self._report.seconds:.2f} s"
        if self._report.needs_bake:
            named = ", ".join(f"'{label}'" for label in self._report.needs_bake)
            text = f"{relit} with the settings of the bake; {named} changed since: bake again"
            self.report({"WARNING"}, text)
        elif self._report.warnings:
            self.report({"WARNING"}, f"{relit}; {self._report.warnings[0].message}")
        else:
            self.report({"INFO"}, relit)
        warn_of_outdated(self, context)


CLASSES = (RADIOSITY_OT_relight,)
