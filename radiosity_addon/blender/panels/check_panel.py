"""*Check*: an estimate of the bake and problems of the scene, in a dialog and in the panel."""

from __future__ import annotations

from typing import Any

import bpy

from ...base import RadiosityError
from ..operators.checks import figures, last_check, look
from ..operators.panel_facts import faces_to_flip
from ..operators.polls import Conditional, has_scene, no_bake_runs
from .face_buttons import draw_face_buttons
from .sections import Section
from .wrapped_text import draw_text

SHOWN_FINDINGS = 10

POPUP_WIDTH = 460

_ICONS = {"ERROR": "CANCEL", "WARNING": "ERROR", "INFO": "INFO"}


class RADIOSITY_OT_check(Conditional, bpy.types.Operator):
    """Show what would be baked, the size of the lightmaps and problems of the scene, without baking"""

    bl_idname = "radiosity.check"
    bl_label = "Check"
    bl_options = {"REGISTER"}

    _shown = False  # in a dialog, whose button bakes

    conditions = (no_bake_runs, has_scene)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Report what is found in the scene; from the dialog, bake it."""
        if self._shown:
            # The dialog is closed by now.
            bpy.ops.radiosity.bake("INVOKE_DEFAULT")
            return {"FINISHED"}
        try:
            found = look(context)
        except RadiosityError as error:
            self.report({"ERROR"}, " ".join(str(error).split()))
            return {"CANCELLED"}
        for finding in found.findings[:SHOWN_FINDINGS]:
            if finding.level != "INFO":
                self.report({"WARNING"}, f"{finding.name}: {finding.message}")
        self.report({"INFO"}, "; ".join(f"{name}: {value}" for name, value in figures(found)))
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Look at the scene and show what was found in a dialog."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        try:
            look(context)
        except RadiosityError as error:
            self.report({"ERROR"}, " ".join(str(error).split()))
            return {"CANCELLED"}
        self._shown = True
        return context.window_manager.invoke_props_dialog(
            self, width=POPUP_WIDTH, title="Before Baking", confirm_text="Bake Radiosity"
        )

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the dialog."""
        found = last_check(context.scene)
        if found is not None:
            draw_inspection(self.layout, found, context, POPUP_WIDTH)


class CheckSection(Section):
    """The result of the last check."""

    name = "radiosity_check"
    label = "Check"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it once the scene was checked."""
        return last_check(context.scene) is not None

    @classmethod
    def draw_header(cls, header: Any, context: bpy.types.Context) -> None:
        """Draw how many problems there are."""
        count = sum(finding.level != "INFO" for finding in last_check(context.scene).findings)
        problems = f"{count or 'No'} problem{'' if count == 1 else 's'}"
        header.label(text=f"Checked: {problems}", icon="ERROR" if count else "CHECKMARK", translate=False)

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw figures and findings."""
        draw_face_buttons(layout, faces_to_flip(context)[1], "bake or check again", context)
        draw_inspection(layout, last_check(context.scene), context, None)


def draw_inspection(layout: Any, found: Any, context: bpy.types.Context, width: float | None) -> None:
    """Draw figures and findings."""
    column = layout.column(align=True)
    for name, value in figures(found):
        split = column.split(factor=0.35)
        split.label(text=name, translate=False)
        split.label(text=value, translate=False)
    if not found.findings:
        layout.label(text="No problems found", icon="CHECKMARK")
    for finding in found.findings[:SHOWN_FINDINGS]:
        draw_text(layout.box(), finding.message, _ICONS[finding.level], context, width)
    hidden = len(found.findings) - SHOWN_FINDINGS
    if hidden > 0:
        layout.label(text=f"and {hidden} more", translate=False)


CLASSES = (RADIOSITY_OT_check,)
