"""Live: lightmaps that follow the lights while somebody drags their sliders.

Blender calls a handler with what has changed. The handler only takes a note; a timer does the rest a moment
later, so that only the last of many changes counts. During changes the images follow by responses
(`responses.py`); afterward the kept bake is lit exactly, in a thread, and the files are written. Writing to
images and materials calls the handler again, but strengths are then unchanged, so nothing follows from it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from functools import partial
from typing import Any

import bpy
import numpy as np

from ...bake.relight import Responses, are_wanted
from ...bake.result import LightGroup
from ...bake.scene_diff import RELIGHTABLE
from ...base import BakeError, Progress, RadiosityError, in_thread
from ...lightmap.images import LightmapPage
from ...numerics import Array
from ..images.group_images import update_images
from ..session.redraw import redraw_viewports
from ..session.state import session
from . import kept_bakes, lightmap_versions
from .live_scene import LiveScene
from .live_strengths import StrengthReader
from .relight_scene import lit, note_shown, noted_strengths, read_strengths
from .relit_images import check_images, rewrite
from .relit_materials import show_emission

TICK = 0.02
"""Seconds between two looks while something is going on."""

QUIET_SECONDS = 0.4
"""Seconds without a change after which the light is made exact."""

AHEAD = 8
"""So many sources' responses are found out before anybody drags their sliders."""


class LiveRelight:
    """Follows the lights of a scene until it is closed.

    Attributes
    ----------
    latency : float
        Seconds from reading the last change to having it in the images.
    changes : int
        How often the images have followed.
    """

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = scene.name_full
        self.latency, self.changes = 0.0, 0
        self._reader: StrengthReader | None = None
        self._fits: LiveScene | None = None
        self._responses: Responses | None = None
        self._strengths: Array = np.zeros((0, 3))
        self._shown: Array = self._strengths
        self._noticed = 0.0
        self._dirty = True
        self._exact = False
        self._work: Generator[Any, None, Any] | None = None
        self._doing: int | None = None
        """The source whose response is found out; None for exact pages."""
        self._lit_by = self._strengths
        _wake()

    def close(self) -> None:
        """Follow nothing any more."""
        if self.is_at_work():
            bpy.app.timers.unregister(_tick)
        self._end_work()

    def is_at_work(self) -> bool:
        """Return whether the timer still has something to do."""
        return bpy.app.timers.is_registered(_tick)

    def settle(self) -> None:
        """Do at one go what the timer would do: for scripts, where no timer fires."""
        while session.live is self and self.step(in_background=False):
            pass

    def look_again(self) -> None:
        """The images were loaded again, after undo or redo: with the light that the scene remembers."""
        if self._reader is None:
            return
        held = self._held()
        self._shown = held.shown = noted_strengths(self._of_scene(), held)
        self._exact = False
        _wake()

    def note(self, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        """Take a note of what changed."""
        if scene.name_full != self._scene or self._fits is None:
            return
        if self._fits.note(depsgraph):
            if not self._dirty:
                self._dirty, self._noticed = True, time.perf_counter()
            _wake()

    def step(self, in_background: bool) -> bool:
        """Do the next thing; False if there is nothing left to do."""
        try:
            if self._reader is None:
                self._begin()
            if self._dirty:
                self.read()
            if self._work is None and not self._choose_work(in_background):
                return not self._exact
            if self._work is not None:
                self._carry_on(in_background)
            return True
        except RadiosityError as error:
            session.stop_live(f"Live is off: {' '.join(str(error).split())}")
            return False

    def _begin(self) -> None:
        """Learn the scene as it is: what its sources are, and what must stay."""
        context = bpy.context
        if context.scene.name_full != self._scene:
            raise BakeError("another scene is shown")
        lightmap_versions.flush()
        held, self._strengths = read_strengths(context)
        self._shown = held.shown
        if are_wanted(held.bake.bake_scene, held.bake.settings):
            raise BakeError("the bake has light groups, whose own sliders change the light at once")
        self._reader = StrengthReader(context.scene, held.bake, self._strengths)
        self._fits = LiveScene(context.scene)
        self._dirty, self._noticed = False, time.perf_counter()
        self._start(None, partial(lit, held.bake, self._strengths))

    def read(self) -> None:
        """Read the strengths, and show them as far as it can be done at once."""
        assert self._reader is not None
        assert self._fits is not None
        self._dirty, started = False, time.perf_counter()
        self._fits.diff(self._reader).refuse_all_but(RELIGHTABLE)
        strengths = self._held().bake.sources.checked(self._reader.read())
        if np.array_equal(strengths, self._strengths):
            return
        self._strengths, self._exact = strengths, False
        if self._responses is not None and self._work is not None and self._doing not in self._wanted():
            self._end_work()
        self._show()
        self.latency = time.perf_counter() - started

    def _show(self) -> None:
        """Bring the images to the strengths read last, if all responses are there."""
        if self._responses is None or self._responses.missing(self._strengths):
            return
        if np.array_equal(self._strengths, self._shown):
            return
        held = self._held()
        mark = kept_bakes.mark_of(self._of_scene())
        images = kept_bakes.images_of(mark)
        pages = tuple(
            LightmapPage(pixels, np.zeros(0, dtype=bool)) for pixels in self._responses.pages(self._strengths)
        )
        check_images(images, pages)
        shown = [images[number] for number in range(len(pages))]
        update_images(shown, pages, {})
        lightmap_versions.unsettle(shown)
        changed = (self._strengths != self._shown).any(axis=1)
        lights = len(held.bake.sources.lights)
        if held.bake.settings.quantity != "radiosity":
            show_emission({held.bake.names[row] for row in np.flatnonzero(changed) if row >= lights})
        self._shown = self._strengths
        self.changes += 1
        redraw_viewports()

    def _choose_work(self, in_background: bool) -> bool:
        """Begin what is most wanted; False if all is done, or it is too early."""
        if self._responses is None:
            return False
        missing = self._wanted()
        if missing:
            self._start(missing[0], partial(self._responses.find, missing[0]))
            return True
        resting = time.perf_counter() - self._noticed > QUIET_SECONDS or not in_background
        if not self._exact and resting:
            self._start(None, partial(lit, self._held().bake, self._strengths))
            return True
        ahead = self._responses.unknown()
        if self._exact and ahead and len(self._strengths) - len(ahead) < min(AHEAD, self._responses.room):
            self._start(ahead[0], partial(self._responses.find, ahead[0]))
            return True
        return False

    def _wanted(self) -> list[int]:
        """Return the sources whose responses are missed now."""
        return [] if self._responses is None else self._responses.missing(self._strengths)

    def _start(self, source: int | None, work: Callable[[Progress], Any]) -> None:
        """Find out a source's response in the thread, or exact pages if it is None."""
        self._work, self._doing, self._lit_by = in_thread(work), source, self._strengths

    def _carry_on(self, in_background: bool) -> None:
        """Go on with what runs in the thread; take its result once it is there."""
        assert self._work is not None
        try:
            while True:
                next(self._work)
                if in_background:
                    return
        except StopIteration as done:
            exact, self._work, self._doing = self._doing is None, None, None
            if exact:
                pages, groups = done.value
                self._take_exact(self._lit_by, pages, groups)
            self._show()

    def _take_exact(
        self, strengths: Array, pages: tuple[LightmapPage, ...], groups: tuple[LightGroup, ...]
    ) -> None:
        """Show exact pages, unless the lights have moved on meanwhile."""
        held = self._held()
        if self._responses is None:
            self._responses = Responses(held.bake, strengths, pages)
        else:
            self._responses.set_exact(strengths, pages)
        if not np.array_equal(strengths, self._strengths):
            return
        scene = self._of_scene()
        rewrite(kept_bakes.mark_of(scene), pages, groups, 0.0)
        note_shown(scene, held, strengths)
        self._shown, self._exact = strengths, True
        redraw_viewports()

    def _end_work(self) -> None:
        work, self._work, self._doing = self._work, None, None
        if work is not None:
            work.close()

    def _of_scene(self) -> bpy.types.Scene:
        scene = bpy.data.scenes.get(self._scene)
        if scene is None:
            raise BakeError("the scene no longer exists")
        return scene

    def _held(self) -> kept_bakes.InMemory:
        held = kept_bakes.find(self._of_scene())
        if held is None:
            raise BakeError("the kept bake is no longer available")
        return held


def _wake() -> None:
    """Have the timer carry on. Persistent, for undo takes other timers away."""
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=0.0, persistent=True)


def _tick() -> float | None:
    """Carry on, as long as there is something to do; nothing may be raised."""
    try:
        live = session.live
        return TICK if live is not None and live.step(in_background=True) else None
    except Exception as error:  # noqa: BLE001 (as above)
        session.stop_live(f"Live is off: {type(error).__name__}: {error}")
        return None
