"""A kept bake after some objects moved: what they do not touch is not traced again.

The objects, their triangles, materials and lamps must be those of the kept bake; only where triangles
are may differ. Lightmaps keep their layout. The result can be moved on.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base import SILENT, BakeWarning, Progress, SceneError
from ..lightmap.update import AffectedTexels, PreviousLight, light_after_move
from ..numerics import Array
from ..options import BakeSettings
from ..scene import BakeObject, BakeScene, Scene, SurfaceImages
from ..solver.emitters import NO_SOURCE
from ..solver.moved_elements import carried
from .pipeline import TexelValues, baked_objects, finish
from .relight import HierarchyReport, KeptBake, same_light, shown
from .result import BakeResult, statistics
from .stages import timed

RIGID = 1e-4
"""Edges that differ by no more than this part have kept their length."""

LIT = 0.97
"""How far the whole is when texels are lit; rough."""


def moved_objects(kept: KeptBake, bake_scene: BakeScene) -> tuple[str, ...]:
    """Return the names of the objects that are elsewhere than when the bake was kept.

    Raises
    ------
    SceneError
        If anything else differs, or the kept bake lacks what `bake_moved` needs.
    """
    return tuple(item.name for item in _moved(kept, bake_scene))


def can_move(kept: KeptBake, bake_scene: BakeScene, settings: BakeSettings) -> bool:
    """Tell whether `bake_moved` can give what a bake of a scene by these settings would."""
    try:
        return kept.settings == settings and bool(moved_objects(kept, bake_scene))
    except SceneError:
        return False


def bake_moved(
    kept: KeptBake, bake_scene: BakeScene, progress: Progress = SILENT
) -> tuple[BakeResult, KeptBake]:
    """Bake a scene in which some objects have moved since a bake was kept.

    Parameters
    ----------
    kept : KeptBake
        Stays as it is.
    bake_scene : BakeScene
        The scene as it is now.

    Returns
    -------
    result : BakeResult
    kept : KeptBake
        Of the scene as it is now.

    Raises
    ------
    SceneError
        If more than places of objects has changed, or nothing has.
    """
    seconds: dict[str, float] = {}
    moved = _moved(kept, bake_scene)
    if not moved:
        raise SceneError("nothing has moved since the last bake; there is nothing to bake anew")
    moves, settings = kept.moves, kept.settings
    assert moves is not None  # or `_moved` refuses
    lighting = progress.stage("light", 0.0, LIT)
    lighting.at(0.0)
    with timed(seconds, "light"):
        solved = carried(kept.solved, bake_scene.scene, bake_scene.emitter)
        geometry = kept.geometry.on(bake_scene.scene)
        rows = [np.arange(item.first, item.first + item.count) for item in moved]
        offset = solved.local.caster.surface_offset
        affected = AffectedTexels.of(kept.geometry, geometry, rows, offset)
        before = PreviousLight(kept.lit, moves.traced, kept.solved.local)
        light, local = light_after_move(before, solved.local, affected, lighting)
    values = shown(light, kept.reflectance, kept.emission, settings, geometry.scratch)
    materials = kept.reflectance, kept.emission
    lit = TexelValues(values, local.caster, light, replace(solved, local=local), materials)
    report = moves.solved.report
    names = dict.fromkeys([*report.get("moved", ()), *(item.name for item in moved)])
    report = {**report, "rays": local.caster.rays, "moved": list(names)}
    told = HierarchyReport(report, moves.solved.warnings)
    baked = baked_objects(bake_scene)
    more = statistics(baked, geometry, light, settings.light), None
    result, after = finish(
        bake_scene, settings, moves.atlas, geometry, told, lit, more, seconds, progress.part(LIT, 1.0)
    )
    assert after is not None  # it keeps what it was given
    warnings = (*result.warnings, *_resized(moved, kept.bake_scene.scene, bake_scene.scene))
    return replace(result, warnings=warnings), after


def _moved(kept: KeptBake, bake_scene: BakeScene) -> list[BakeObject]:
    """Return the objects that are elsewhere; see `moved_objects`."""
    if kept.moves is None:
        raise SceneError("the kept bake can be lit anew, but nothing in it moved; bake again")
    _check_objects(kept.bake_scene, bake_scene)
    _check_layout(kept, bake_scene)
    _check_surfaces(kept.bake_scene, bake_scene)
    before, now = kept.bake_scene.scene, bake_scene.scene
    if len(before.lights) != len(now.lights):
        raise SceneError("the number of lamps has changed; bake again")
    for light, other in zip(before.lights, now.lights, strict=True):
        if not same_light(light, other):
            raise SceneError(f"lamp '{light.name}' has changed; bake again")
    elsewhere = (before.triangles != now.triangles).any(axis=(1, 2))
    elsewhere |= (before.normals != now.normals).any(axis=(1, 2))
    return [item for item in bake_scene.objects if elsewhere[item.rows].any()]


def _check_objects(before: BakeScene, now: BakeScene) -> None:
    """Refuse other objects, or other meshes of theirs."""
    if [item.name for item in before.objects] != [item.name for item in now.objects]:
        raise SceneError("objects have been added, removed or renamed; bake again")
    for was, item in zip(before.objects, now.objects, strict=True):
        same = was.count == item.count and was.bake == item.bake and was.texel_scale == item.texel_scale
        same = same and np.array_equal(was.polygon, item.polygon) and np.array_equal(was.loops, item.loops)
        if not same:
            raise SceneError(f"object '{item.name}' has another mesh, or is baked otherwise; bake again")


def _check_layout(kept: KeptBake, now: BakeScene) -> None:
    """Refuse lightmap coordinates of objects' own that are others than when the bake was kept."""
    for was, item in zip(kept.bake_scene.objects, now.objects, strict=True):
        if item.uv is None and was.uv is None:
            continue
        laid_out = kept.geometry.uv[item.rows] if was.uv is None else was.uv
        if item.uv is None or (item.bake and not np.array_equal(item.uv, laid_out)):
            raise SceneError(f"object '{item.name}' has other lightmap coordinates; bake again")


def _check_surfaces(before: BakeScene, now: BakeScene) -> None:
    """Refuse surfaces that reflect, emit or stop light otherwise."""
    was, scene = before.scene, now.scene
    names = ("reflectance", "emission", "opacity", "two_sided", "in_bounces", "in_shadows")
    differs = np.zeros(len(scene), dtype=bool)
    for name in names:
        one, other = getattr(was, name), getattr(scene, name)
        differs |= (one != other).reshape(len(scene), -1).any(axis=1)
    differs |= (was.areas > 0) != (scene.areas > 0)
    emits = scene.emission.any(axis=1)
    one, other = (
        np.full(len(scene), NO_SOURCE) if some.emitter is None else some.emitter for some in (before, now)
    )
    differs |= emits & (one != other)
    for item in now.objects:
        if differs[item.rows].any():
            raise SceneError(f"object '{item.name}' has another material; bake again")
    if not _same_images(was.images, scene.images):
        raise SceneError("a textured material has changed; bake again")


def _same_images(one: SurfaceImages | None, other: SurfaceImages | None) -> bool:
    """Whether textures are the same."""
    if one is None or other is None:
        return one is other
    return one.same_as(other)


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
                    "bake again to share them out anew",
                )
            )
    return tuple(found)


def _edges(triangles: Array) -> Array:
    """Return (t, 3) the lengths of edges [m]."""
    return np.asarray(np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2))
