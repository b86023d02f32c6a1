"""A kept bake after some objects moved: what they do not touch is not traced again.

The objects, their triangles, materials and lamps must be those of the kept bake; only where triangles
are may differ. Lightmaps keep their layout. The result can be moved on.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base import SILENT, BakeWarning, Progress, SceneError
from ..lightmap.lighting import light_texels, lit_as_texels
from ..lightmap.update import AffectedTexels, PreviousLight
from ..numerics import Array, one_blas_thread
from ..scene import BakeObject, BakeScene, Scene
from ..solver.moved_elements import carried
from .pipeline import TexelValues, baked_objects, finish
from .plan import moved_objects
from .relight import HierarchyReport, KeptBake, held_values
from .result import BakeResult, statistics
from .stages import StageTimes, timed

RIGID = 1e-4
"""Edges that differ by no more than this part have kept their length."""

LIT = 0.97
"""How far the whole is when texels are lit; rough."""


@one_blas_thread()
def bake_moved(
    kept: KeptBake, bake_scene: BakeScene, progress: Progress = SILENT
) -> tuple[BakeResult, KeptBake]:
    """Bake a scene in which some objects have moved since a bake was kept.

    kept: Stays as it is.
    bake_scene: The scene as it is now.
    Returns kept: Of the scene as it is now.
    Raises SceneError if more than places of objects has changed, or nothing has.
    """
    seconds = StageTimes()
    names = moved_objects(kept, bake_scene)
    if not names:
        raise SceneError("nothing has moved since the last bake; there is nothing to update")
    moved = [item for item in bake_scene.objects if item.name in names]
    moves, settings = kept.moves, kept.settings
    assert moves is not None  # or `moved_objects` refuses
    lighting = progress.stage("light", 0.0, LIT)
    lighting.at(0.0)
    with timed(seconds, "light"):
        solved = carried(kept.solved, bake_scene.scene, bake_scene.emitter)
        geometry = kept.geometry.on(bake_scene.scene)
        rows = [np.arange(item.first, item.first + item.count) for item in moved]
        offset = solved.local.caster.surface_offset
        affected = AffectedTexels.of(kept.geometry, geometry, rows, offset)
        before = PreviousLight(kept.lit, moves.traced, kept.solved.local, affected)
        gather = moves.traced.settings
        light = light_texels(bake_scene.scene, solved.local, geometry, gather, before, progress=lighting)
        local = lit_as_texels(solved.local, kept.lit.element, light)
    values = held_values(light, kept.reflectance, kept.emission, settings, geometry.scratch)
    materials = kept.reflectance, kept.emission
    lit = TexelValues(values, local.caster, light, replace(solved, local=local), materials)
    report = moves.solved.report
    ever = dict.fromkeys([*report.get("moved", ()), *names])
    report = {**report, "rays": local.caster.rays, "moved": list(ever)}
    # The solution's own, from before the move.
    report.pop("power_W", None)
    facts = HierarchyReport(report, moves.solved.warnings)
    baked = baked_objects(bake_scene)
    more = statistics(baked, geometry, light, settings.light), None
    result, after = finish(
        bake_scene, settings, moves.atlas, geometry, facts, lit, more, seconds, progress.part(LIT, 1.0)
    )
    assert after is not None  # it keeps what it was given
    warnings = (*result.warnings, *_resized(moved, kept.bake_scene.scene, bake_scene.scene))
    return replace(result, warnings=warnings), after


def _resized(moved: list[BakeObject], before: Scene, now: Scene) -> tuple[BakeWarning, ...]:
    """Warn of objects that have another size or shape: their charts are as they were."""
    found = []
    for item in moved:
        one, other = _edges(before.triangles[item.rows]), _edges(now.triangles[item.rows])
        if np.abs(one - other).max(initial=0.0) > RIGID * one.max(initial=0.0):
            found.append(
                BakeWarning(
                    item.name,
                    f"object '{item.name}' has another size or shape but keeps its texels: "
                    "bake again for an even density",
                )
            )
    return tuple(found)


def _edges(triangles: Array) -> Array:
    """Return (t, 3) the lengths of edges [m]."""
    return np.asarray(np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2))
