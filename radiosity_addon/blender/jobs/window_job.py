"""Work that a script runs through and a window does in turns: what *Bake* and *Relight* have in common."""

from __future__ import annotations

import time
from typing import Any

import bpy

from ...base import NothingToDoError, RadiosityError, RemainingTime
from ..session import facts
from ..session.redraw import redraw_sidebars
from ..session.state import session
from . import live_view
from .file_watch import guarded
from .progress_text import progress_text

TICK = 0.005
"""Seconds of looking after the work between two redraws: the work itself goes on in its thread."""

TURNS = 0.01
"""Seconds between two looks."""

# What still works meanwhile: looking around.
_NAVIGATION = {
    "MOUSEMOVE",
    "INBETWEEN_MOUSEMOVE",
    "MIDDLEMOUSE",
    "WHEELUPMOUSE",
    "WHEELDOWNMOUSE",
    "TRACKPADPAN",
    "TRACKPADZOOM",
    "MOUSEROTATE",
    "NDOF_MOTION",
    "WINDOW_DEACTIVATE",
}


class WindowJob:
    """A mixin of operators whose work is a generator of `Status` that returns a report.

    An operator fills in `_start`, which returns the generator, and `_succeeded`; closing the generator must
    leave everything as it was.
    """

    # Blender evaluates annotations when it registers the class: no names of later imports.
    _job: Any = None  # the generator while it runs
    _report: Any = None  # what it returned
    _timer: bpy.types.Timer | None = None
    _ticked: float = 0.0  # the timer's time when it last carried the work on
    _remaining: Any = None  # RemainingTime of the work that runs
    report: Any  # the operator's own

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Run the work through."""
        try:
            self._begin(context, in_window=False)
            while not self._advance(float("inf")):
                pass
        except RadiosityError as error:
            return self._fail(context, error)
        except BaseException:
            self._end(context)
            raise
        return self._finish(context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Start the work; a timer carries it on."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        try:
            self._begin(context, in_window=True)
        except RadiosityError as error:
            return self._fail(context, error)
        manager = context.window_manager
        self._timer = manager.event_timer_add(TURNS, window=context.window)
        manager.progress_begin(0, 100)
        self._show_progress(context)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Carry on for a tick, or cancel."""
        if self._job is None:  # ended from outside
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            self._end(context)
            self._undone(context)
            self.report({"INFO"}, "Canceled; nothing was changed")
            return {"CANCELLED"}
        if not event.type.startswith("TIMER"):
            return {"PASS_THROUGH"} if event.type in _NAVIGATION else {"RUNNING_MODAL"}
        # All timers' events are passed on: where ours and another's come together, either may be the first.
        if event.type != "TIMER" or not self._is_our_turn():
            return {"PASS_THROUGH"}
        try:
            if not self._advance(TICK):
                self._show_progress(context)
                return {"PASS_THROUGH"}
        except RadiosityError as error:
            return self._fail(context, error)
        except BaseException:
            self._end(context)
            raise
        return self._finish(context)

    def _is_our_turn(self) -> bool:
        """Return whether our timer has come: events do not say whose they are, but it counts on."""
        now = 0.0 if self._timer is None else self._timer.time_duration
        if now == self._ticked:
            return False
        self._ticked = now
        return True

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator from outside: a window closes, or Blender quits."""
        self._end(context)

    def _start(self, context: bpy.types.Context, in_window: bool) -> Any:
        """Return the work's generator."""
        raise NotImplementedError

    def _follow(self, progress: Any) -> None:
        """Show the picture that a step of the work brings, if any, in addition to its progress."""

    def _undone(self, context: bpy.types.Context) -> None:
        """Go on as before the work, which was canceled or failed."""

    def _succeeded(self, context: bpy.types.Context, in_window: bool) -> None:
        """Report on what was done."""
        raise NotImplementedError

    def _begin(self, context: bpy.types.Context, in_window: bool) -> None:
        self._report = None
        self._job = guarded(self._start(context, in_window), context)
        self._ticked = 0.0
        running = session.running
        running.active, running.stop = True, lambda: self._end(bpy.context)
        running.stage, running.fraction, running.seconds_left = "export", 0.0, None
        self._remaining = RemainingTime()

    def _advance(self, seconds: float) -> bool:
        """Work for about so long; True once it is done."""
        until = time.perf_counter() + seconds
        running = session.running
        while time.perf_counter() < until:
            try:
                progress = next(self._job)
            except StopIteration as done:
                self._report = done.value
                return True
            running.stage, running.fraction = progress.stage, progress.fraction
            running.seconds_left = self._remaining.update(progress.fraction, progress.expected)
            self._follow(progress)
        return False

    def _show_progress(self, context: bpy.types.Context) -> None:
        context.window_manager.progress_update(int(100 * session.running.fraction))
        context.workspace.status_text_set(f"{progress_text(session.running)}    {'Esc cancels'}")
        redraw_sidebars()

    def _finish(self, context: bpy.types.Context) -> set[str]:
        in_window = self._timer is not None
        self._end(context)
        self._succeeded(context, in_window)
        facts.refresh()
        return {"FINISHED"}

    def _fail(self, context: bpy.types.Context, error: RadiosityError) -> set[str]:
        self._end(context)
        self._undone(context)
        kind = "INFO" if isinstance(error, NothingToDoError) else "ERROR"
        self.report({kind}, " ".join(str(error).split()))
        return {"CANCELLED"}

    def _end(self, context: bpy.types.Context) -> None:
        """Close the work in any state, and everything shown about it."""
        job, self._job = self._job, None
        try:
            if job is not None:
                job.close()
        finally:
            session.running.active, session.running.stop = False, None
            live_view.end()
            if self._timer is not None:
                context.window_manager.event_timer_remove(self._timer)
                context.window_manager.progress_end()
                if context.workspace is not None:  # the window may be closing
                    context.workspace.status_text_set(None)
                self._timer = None
            redraw_sidebars()
