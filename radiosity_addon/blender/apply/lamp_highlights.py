"""Whether lamps of baked scenes make highlights: their *Ray Visibility → Glossy*, which Restore puts back.

The light that a lamp sends to what shines is the lamp's matter: no node knows where light comes from. What
was there hangs on the lamp itself, so that it goes along with copies of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import bpy

from ...base import BakeWarning
from .shown_state import showing

SWITCHED_OFF = "radiosity_highlights"
"""On a lamp: we switched its *Glossy* off. Where it is on all the same, the user wants its highlights."""


def show_highlights(shown: bool) -> tuple[BakeWarning, ...]:
    """Have lamps make highlights or none, in all scenes that show lightmaps; others have what is theirs.

    Returns warnings: Of lamps that are linked, which keep theirs.
    """
    lamps = [] if shown else _lamps_of_bakes()
    _put_back_but(lamps)
    warnings = []
    for lamp in lamps:
        if not lamp.visible_glossy or lamp.get(SWITCHED_OFF):
            continue
        if lamp.library is None and lamp.override_library is None:
            lamp.visible_glossy, lamp[SWITCHED_OFF] = False, True
        else:
            message = (
                f"lamp '{lamp.name}' is linked, so it still makes highlights: switch Glossy off in its file"
            )
            warnings.append(BakeWarning(lamp.name, message))
    return tuple(warnings)


def put_unused_back() -> None:
    """Have those lamps make highlights again that are in no scene with lightmaps any more."""
    _put_back_but(_lamps_of_bakes())


def highlights_kept() -> Callable[[], None]:
    """Return what makes the lamps of now, as far as they still exist, as they are now."""
    before = {
        lamp.session_uid: (lamp.visible_glossy, SWITCHED_OFF in lamp)
        for lamp in bpy.data.objects
        if lamp.type == "LIGHT" and lamp.library is None
    }

    def put_back() -> None:
        for lamp in bpy.data.objects:
            visible, is_off = before.get(lamp.session_uid, (None, False))
            if visible is None or (lamp.visible_glossy, SWITCHED_OFF in lamp) == (visible, is_off):
                continue
            lamp.visible_glossy = visible
            lamp.pop(SWITCHED_OFF, None)
            if is_off:
                lamp[SWITCHED_OFF] = True

    return put_back


def _put_back_but(lamps: Sequence[bpy.types.Object]) -> None:
    """Have all lamps but some make highlights again."""
    for obj in bpy.data.objects:
        if obj.library is None and obj.get(SWITCHED_OFF) is not None and obj not in lamps:
            obj.visible_glossy = True
            del obj[SWITCHED_OFF]


def _lamps_of_bakes() -> list[bpy.types.Object]:
    """Return the lamps of all scenes that show lightmaps, as far as they light diffuse surfaces."""
    scenes = dict.fromkeys(scene for obj in showing() for scene in obj.users_scene)
    lamps = dict.fromkeys(obj for scene in scenes for obj in scene.objects if obj.type == "LIGHT")
    return [lamp for lamp in lamps if lamp.visible_diffuse and not lamp.hide_render]
