"""What the user edited since the bake whose lightmaps are exported: they show the light of before."""

from __future__ import annotations

import json
from collections.abc import Generator

import bpy

from ...bake import BakeDigests, ShownBake
from ...bake.scene_diff import light_summaries
from ...base import RadiosityError
from ..apply.rebake import Originals
from ..apply.shown_bake import baked_lights, is_as_remembered, remember_content, shown_bake
from ..relight.relight_properties import relight_of
from ..scene_export.export import export_steps


def edits_since_bake(
    context: bpy.types.Context, in_background: bool = False
) -> Generator[float, None, list[str]]:
    """Compare the context's scene with what it remembers of its bake; returns what to note.

    Reading the scene as a bake does takes seconds: where the file holds what it held, that is not done.
    Yields fraction: As `export_steps`.
    """
    scene = context.scene
    objects, remembered = json.loads(scene.radiosity.baked_objects or "{}"), baked_lights(scene)
    if not objects or remembered is None or is_as_remembered(scene):
        return []
    settings, lights = remembered
    originals = Originals(context)
    try:
        export = yield from export_steps(context, settings, False, in_background, originals)
    except RadiosityError as error:
        return [f"the scene could not be compared with its bake: {error}"]
    shown = shown_bake(scene, export) or ShownBake({}, objects)
    is_relit = bool(relight_of(scene).strengths)
    differs = (
        shown.edits(BakeDigests.of(export.bake_scene, settings))
        .with_lights(lights, light_summaries(export.bake_scene), strengths=not is_relit)
        .described
    )
    if not differs:
        remember_content(scene)
    notes = [f"{differs}; the lightmaps show their light of before: bake again"] if differs else []
    return [*(warning.message for warning in originals.warnings), *notes]
