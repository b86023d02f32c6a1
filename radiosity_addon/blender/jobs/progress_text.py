"""What status bar and panel say of a running bake, in the user's language."""

from __future__ import annotations

from bpy.app.translations import pgettext_iface as iface_

from ...base import duration
from ..session.runtime import Running


def stage_label(stage: str) -> str:
    """Return a stage's name for people; that of one not known here is its own."""
    # Each a literal: only these are found by who translates.
    labels = {
        "export": iface_("Reading the scene"),
        "unwrap": iface_("Unwrapping"),
        "rasterise": iface_("Finding texels"),
        "solve": iface_("Solving"),
        "light": iface_("Lighting texels"),
        "encode": iface_("Stitching seams"),
        "groups": iface_("Lighting groups"),
        "read": iface_("Reading the bake"),
        "relight": iface_("Lighting anew"),
        "sidecar": iface_("Writing the sidecar"),
        "apply": iface_("Applying"),
        "save": iface_("Saving"),
        "preview": iface_("Rendering the preview"),
        "write": iface_("Writing"),
    }
    return labels.get(stage, stage)


def progress_text(running: Running) -> str:
    """Return stage, share done and time left, such as 'Solving  34 %  about 12 s left'."""
    percent = f"{int(100 * running.fraction)} %"
    text = f"{stage_label(running.stage)}  {percent}"
    if running.seconds_left is None:
        return text
    return text + "  " + iface_("about {} left").format(duration(running.seconds_left))
