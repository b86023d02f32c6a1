"""*Check*: what a bake will be and what is odd, in a pop-up and in the panel, before time is spent."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...base.errors import RadiosityError
from ...cli.time_left import duration
from ..relight.relight_properties import keeps, relight_of
from ..session import runtime
from .preferences import preferences
from .properties import settings_of
from .sections import Section
from .wrapped_text import draw_text

SHOWN_FINDINGS = 10

POPUP_WIDTH = 460

_ICONS = {"ERROR": "CANCEL", "WARNING": "ERROR", "INFO": "INFO"}

_checked: dict[tuple[str, str], Any] = {}
"""(file, scene) → its last Inspection: what the panel draws, and whether the first bake was looked at."""


class RADIOSITY_OT_check(bpy.types.Operator):
    """Show what will be baked, how large the lightmaps get and what is odd, before time is spent on a bake"""

    bl_idname = "radiosity.check"
    bl_label = "Check"
    bl_options = {"REGISTER"}

    _shown = False  # in a dialog, whose button bakes

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Offer it unless a bake is running."""
        if runtime.running.active:
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


def look(context: bpy.types.Context) -> Any:
    """Inspect the context's scene as the panel would bake it, and remember what was found."""
    from ..files.output import OutputFolder
    from ..files.ownership import panel_names
    from ..jobs.inspection import inspect
    from .preferences import output_folder

    editing = context.mode == "EDIT_MESH"
    try:
        settings, folder = settings_of(context), output_folder(context)
        output = None if folder is None else OutputFolder(folder, panel_names(context.scene))
        kept = output is not None and keeps(context.scene, settings) and relight_of(context.scene).sidecar
        found = inspect(context, settings, folder, output, [output.names.sidecar] if output and kept else ())
    finally:
        if editing and context.mode == "OBJECT" and bpy.ops.object.mode_set.poll():
            bpy.ops.object.mode_set(mode="EDIT")
    _checked[_key(context.scene)] = found
    return found


def last_check(scene: bpy.types.Scene) -> Any:
    """Return what was found of a scene when somebody last looked; None if nobody did."""
    return _checked.get(_key(scene))


def look_first(context: bpy.types.Context) -> bool:
    """Tell whether a scene that was neither baked nor checked is odd, so that the user should look first."""
    scene = context.scene
    known = runtime.last_bake(scene) is not None or last_check(scene) is not None
    if known or not preferences(context).check_first:
        return False
    return bool(look(context).is_odd)


def forget_checks() -> None:
    """Drop what was found, as the extension is switched off."""
    _checked.clear()


def figures(found: Any) -> list[tuple[str, str]]:
    """Return what a bake will be as pairs of a name and a value, in the user's language."""
    plan = found.estimate
    sizes: dict[int, int] = {}
    for page in plan.pages:
        sizes[page] = sizes.get(page, 0) + 1
    pages = ", ".join(f"{count} × {size}²" for size, count in sizes.items())
    return [
        (iface_("Objects"), f"{found.objects:,}"),
        (iface_("Triangles"), f"{found.triangles:,} / {found.scene_triangles:,}"),
        (iface_("Images"), pages or "0"),
        (iface_("Texels"), iface_("about {}").format(f"{_rounded(found.texels):,}")),
        (iface_("Memory"), iface_("about {}").format(_bytes(plan.memory))),
        (
            iface_("Time"),
            iface_("until the error is reached")
            if plan.seconds is None
            else iface_("roughly {}").format(duration(plan.seconds)),
        ),
    ]


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
        layout.label(text=iface_("and {} more").format(hidden), translate=False)


def _key(scene: bpy.types.Scene) -> tuple[str, str]:
    return bpy.data.filepath, scene.name_full


def _rounded(count: int) -> int:
    """Round to two digits: it is not known any better."""
    return int(float(f"{count:.2g}"))


def _bytes(count: float) -> str:
    return f"{count / 1e9:.1f} GB" if count >= 1e9 else f"{round(count / 1e6, -1):.0f} MB"


CLASSES = (RADIOSITY_OT_check,)
