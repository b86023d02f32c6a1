"""*Check*: what a bake will be and what is odd, in a pop-up and in the panel, before time is spent."""

from __future__ import annotations

from typing import Any

import bpy

from ...base import RadiosityError
from ..operators.checks import figures, last_check, look
from ..session.state import session
from .sections import Section
from .wrapped_text import draw_text

SHOWN_FINDINGS = 10

POPUP_WIDTH = 460

_ICONS = {"ERROR": "CANCEL", "WARNING": "ERROR", "INFO": "INFO"}


class RADIOSITY_OT_check(bpy.types.Operator):
    """Show what will be baked, how large the lightmaps get and what is odd, before time is spent on a bake"""

    bl_idname = "radiosity.check"
    bl_label = "Check"
    bl_options = {"REGISTER"}

    _shown = False  # in a dialog, whose button bakes

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Offer it unless a bake is running."""
        if session.running.active:
            cls.poll_message_set("A bake is running; press Esc to cancel it")
            return False
        if context.scene is None:
            cls.poll_message_set("There is no scene")
            return False
        return True

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
    """What the next bake will be."""

    name = "radiosity_check"
    label = "Before Baking"

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw the button, and what was found last."""
        layout.operator("radiosity.check", icon="VIEWZOOM")
        found = last_check(context.scene)
        if found is not None:
            draw_inspection(layout, found, context, None)


def draw_inspection(layout: Any, found: Any, context: bpy.types.Context, width: float | None) -> None:
    """Draw figures and findings."""
    column = layout.column(align=True)
    for name, value in figures(found):
        split = column.split(factor=0.35)
        split.label(text=name, translate=False)
        split.label(text=value, translate=False)
    if not found.findings:
        layout.label(text="Nothing is odd", icon="CHECKMARK")
    for finding in found.findings[:SHOWN_FINDINGS]:
        draw_text(layout.box(), finding.message, _ICONS[finding.level], context, width)
    hidden = len(found.findings) - SHOWN_FINDINGS
    if hidden > 0:
        layout.label(text=f"and {hidden} more", translate=False)


CLASSES = (RADIOSITY_OT_check,)
