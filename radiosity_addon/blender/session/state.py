"""What this Blender knows besides what its files hold: one object for jobs, panels, overlays and Live."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

import bpy

# Plain classes: decorators of records would take a third of the time to load this.


class RunningJob:
    """The bake or relighting in progress, if any.

    seconds_left: None while no estimate is possible.
    stop: Ends it from outside its operator.
    """

    def __init__(self) -> None:
        self.active = False
        self.stage = ""
        self.fraction = 0.0
        self.seconds_left: float | None = None
        self.stop: Callable[[], None] | None = None


class Versions:
    """Which versions of lightmap files are shown and held for undo.

    message: For panels; empty while images and files belong together.
    reports: By the digest of each image that they list, the reports of files that were replaced.
    shown: By image, the version of its pixels in memory; empty for pixels that are in no file.
    swap: Files on their way back.
    """

    def __init__(self) -> None:
        self.message = ""
        self.held: Any = None
        self.reports: OrderedDict[str, dict[str, Any]] = OrderedDict()
        self.shown: dict[str, str] = {}
        self.swap: Any = None


class Drawn:
    """The overlay on the graphics card, what it was made for, and the lightmaps read for it."""

    def __init__(self) -> None:
        self.key: tuple[object, ...] | None = None
        self.picture: Any = None
        self.surfaces: Any = None
        self.lines: list[tuple[Any, Any]] = []
        self.pages: dict[str, Any] = {}
        self.statistics: dict[tuple[str, str], Any] = {}

    def clear(self) -> None:
        """Draw it again from lightmaps that were read already."""
        self.key, self.picture, self.surfaces, self.lines = None, None, None, []

    def forget(self) -> None:
        """Read lightmaps again, too."""
        self.clear()
        self.pages.clear()
        self.statistics.clear()


class Session:
    """Everything that is kept in memory until another file is opened.

    interrupted: Whether a bake of the open file was killed while it replaced its lightmaps.
    live: Follows the lights now.
    live_message: Why Live is off, unless the user switched it off.
    kept_bakes: Bakes for relighting by their marks, oldest first.
    kept_details: Of a scene's last bake, for overlays, by the scene's full name.
    checks: The last check of a scene, by the scene's full name.
    edited: Names of stand-ins that were changed and not looked at yet.
    facts: What panels show, by the function that works it out and the scene (`facts.py`).
    wanted_facts: When each was last drawn [s].
    facts_made: When they were last worked out [s].
    on_lightmaps_changed: Called when lightmaps on objects have changed.
    """

    def __init__(self) -> None:
        self.running = RunningJob()
        self.interrupted = False
        self.live: Any = None
        self.live_message = ""
        self.kept_bakes: dict[str, Any] = {}
        self.kept_details: dict[str, Any] = {}
        self.checks: dict[str, Any] = {}
        self.edited: set[str] = set()
        self.facts: dict[Any, Any] = {}
        self.wanted_facts: dict[Any, float] = {}
        self.facts_made = float("-inf")
        self.versions = Versions()
        self.drawn = Drawn()
        self.on_lightmaps_changed: list[Callable[[], None]] = []

    def stop_running(self) -> None:
        """End the bake in progress, as the extension is switched off."""
        if self.running.stop is not None:
            self.running.stop()

    def stop_live(self, message: str = "") -> None:
        """Switch Live off, and keep the reason for the panel; harmless where it is off."""
        live, self.live, self.live_message = self.live, None, message
        if live is None:
            return
        live.close()
        manager = bpy.context.window_manager
        if manager is not None and getattr(manager, "radiosity_live", False):
            manager.radiosity_live = False

    def lightmaps_changed(self) -> None:
        """Notify everything that draws or caches lightmaps."""
        for listener in self.on_lightmaps_changed:
            listener()

    def forget_file(self) -> None:
        """Forget what belongs to the open file: another one is being opened, or the extension goes."""
        self.stop_live()
        self.kept_bakes.clear()
        self.kept_details.clear()
        self.checks.clear()
        self.edited.clear()
        self.facts.clear()
        self.drawn.forget()
        self.interrupted = False


session = Session()


def forget_file(*_: object) -> None:
    """Handler of opening a file."""
    session.forget_file()


def note_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Handler of changes: Live looks at them, if it is on; nothing may be raised."""
    try:
        if session.live is not None:
            session.live.note(scene, depsgraph)
    except Exception as error:  # noqa: BLE001 (Blender would print it at every change)
        session.stop_live(f"Live is off: {type(error).__name__}: {error}")
