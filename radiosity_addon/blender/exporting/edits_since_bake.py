"""What the user edited since the bake whose lightmaps are exported: they show the light of before."""

from __future__ import annotations

import json
from collections.abc import Generator

import bpy

from ...bake import BakeDigests, ShownBake
from ...base import RadiosityError
from ...options import BakeSettings
from ..apply.rebake import Originals
from ..apply.shown_bake import shown_bake
from ..scene_export.export import export_steps


def edits_since_bake(
    context: bpy.types.Context, in_background: bool = False
) -> Generator[float, None, list[str]]:
    """Compare the context's scene with what it remembers of its bake; returns what to note.

    As *Changed* does, but for lamps: the digest of their light is one with that of the bake's settings.
    Yields fraction: As `export_steps`.
    """
    objects = json.loads(context.scene.radiosity.baked_objects or "{}")
    # A bake of an earlier version does not say how finely it looked at textures.
    resolution = context.scene.radiosity.baked_resolution
    if not objects or not resolution:
        return []
    settings = BakeSettings(resolution=resolution)
    shown = Originals(context)
    try:
        export = yield from export_steps(context, settings, False, in_background, shown)
    except RadiosityError as error:
        return [f"the scene could not be compared with its bake: {error}"]
    remembered = shown_bake(context.scene, export) or ShownBake({}, objects)
    differs = remembered.described(BakeDigests.of(export.bake_scene, settings))
    notes = [f"{differs}; the lightmaps show their light of before: bake again"] if differs else []
    return [*(warning.message for warning in shown.warnings), *notes]
