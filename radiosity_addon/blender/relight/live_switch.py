"""The switch *Live* of the session: on, it follows the lights of the scene in front of the user."""

from __future__ import annotations

import bpy

from ..session.state import session


def start(scene: bpy.types.Scene) -> None:
    """Follow the lights of a scene from now on."""
    from .live_relight import LiveRelight  # with the solver, which registering is not to load

    session.stop_live()
    session.live = LiveRelight(scene)


def _switched(manager: bpy.types.WindowManager, context: bpy.types.Context) -> None:
    if manager.radiosity_live:
        start(context.scene)
    elif session.live is not None:
        session.stop_live()


def register() -> None:
    """Hang the switch on the session."""
    bpy.types.WindowManager.radiosity_live = bpy.props.BoolProperty(
        name="Live",
        description="Update the lightmaps while you change the power or color of lamps, emission or the "
        "world. Any other change turns this off",
        default=False,
        update=_switched,
        options={"SKIP_SAVE"},
    )


def unregister() -> None:
    """Follow no lights any more, and take the switch away."""
    session.stop_live()
    del bpy.types.WindowManager.radiosity_live
