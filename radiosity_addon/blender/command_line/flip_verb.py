"""The verb `flip`: faces that show their backs are flipped, and the scene written to another file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy

from ...base import UsageError
from ...cli import Console, Interrupts, Permissions, run_through
from ...options import BakeSettings
from ..apply.edits import carry_edits
from ..apply.face_flips import Flipped
from ..apply.face_flips import flip as flip_faces
from ..files.files import open_scene
from ..files.saved_files import save_scene
from ..files.single_files import check_existing, check_places, make_folder_of
from ..jobs.job import find_turned_faces
from ..session.turned_faces import TurnedFaces
from . import verbs

SEARCH = BakeSettings(quality="sketch", resolution=256)
"""How the light is found that tells fronts from backs."""

MOST_NAMED = 8
"""So many objects are named one by one."""


def flip(
    scene: Path | None,
    loaded: Path | None,
    output: Path,
    allowed: Permissions,
    console: Console,
    interrupts: Interrupts,
) -> None:
    """Flip the faces of a scene that show their backs, as the panel's *Flip Faces* does after a bake.

    Parameters
    ----------
    scene, loaded, allowed, console, interrupts
        As for `verbs.bake`.
    output : Path
        The .blend that the flipped scene is written to; the scene itself stays as it is.

    Raises
    ------
    RadiosityError
        If the scene cannot be baked, or the file may not be written.
    """
    with verbs.registered():
        if scene is None and loaded is None:
            raise UsageError("flip needs SCENE, the file whose faces are to be flipped")
        check_places({"--output": output}, scene or loaded)
        console.progress("open", 0.0)
        notes = open_scene(scene, allowed.scripts) if scene is not None else ()
        check_existing("--output", output, allowed.overwrite)
        notes = (*notes, *carry_edits(bpy.context))
        found, seen = run_through(find_turned_faces(bpy.context, SEARCH), console, interrupts)
        # Such as that there is no light to tell fronts from backs; what is of objects, their bake will say.
        notes = (*notes, *(note for note in seen if note.name in ("scene", bpy.context.scene.name)))
        flipped = flip_faces(bpy.context, found, [faces.object for faces in found])
        make_folder_of(output)
        save_scene(output)
    lines = [f"  {name}" for name in flipped.objects[:MOST_NAMED]]
    if len(flipped.objects) > MOST_NAMED:
        lines.append(f"  and {len(flipped.objects) - MOST_NAMED} more")
    warnings = [*(note.message for note in notes), *flipped.refusals]
    console.lines(
        [_told(found, flipped, output), *lines, *(f"warning: {message}" for message in warnings)]
    )


def _told(found: Sequence[TurnedFaces], flipped: Flipped, output: Path) -> str:
    """Return what has become of the faces that were found, in a line."""
    if not found:
        return f"no faces that show their backs were found; {output} is the scene as it was"
    faces = f"{flipped.faces:,} face{'' if flipped.faces == 1 else 's'}"
    objects = f"{len(flipped.objects)} object{'' if len(flipped.objects) == 1 else 's'}"
    return f"{faces} of {objects} flipped, written to {output}"
