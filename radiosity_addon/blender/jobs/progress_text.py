"""What the status bar and the panel say of a running bake."""

from __future__ import annotations

from ...base import duration
from ..session.state import RunningJob

STAGES = {
    "export": "Reading the scene",
    "unwrap": "Unwrapping",
    "rasterise": "Finding texels",
    "solve": "Solving",
    "light": "Lighting texels",
    "encode": "Stitching seams",
    "groups": "Lighting groups",
    "read": "Reading the bake",
    "relight": "Relighting",
    "sidecar": "Writing the sidecar",
    "apply": "Applying",
    "save": "Saving",
    "preview": "Rendering the preview",
    "write": "Writing",
}


def progress_text(running: RunningJob) -> str:
    """Return stage, share done and time left, such as 'Solving  34 %  about 12 s left'."""
    text = f"{STAGES.get(running.stage, running.stage)}  {int(100 * running.fraction)} %"
    if running.seconds_left is None:
        return text
    return f"{text}  about {duration(running.seconds_left)} left"
