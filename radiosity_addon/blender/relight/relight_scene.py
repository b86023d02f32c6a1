"""Relight a kept bake with the scene's present lights: what the button and Live's first step run."""

from __future__ import annotations

import json
import time
from collections.abc import Generator
from dataclasses import dataclass

import bpy
import numpy as np

from ...bake.relight import (
    KeptBake,
    are_wanted,
    estimated_errors,
    group_pages,
    noise_warnings,
    relight_pages,
    strengths_in,
)
from ...bake.result import LightGroup
from ...bake.scene_diff import OF_NO_CONSEQUENCE
from ...bake.sidecar import StoredBake, read_sidecar
from ...base import SILENT, BakeError, BakeWarning, Progress, Status, drain, in_thread, staged
from ...lightmap.images import LightmapPage
from ...numerics import Array
from ..apply.rebake import Originals
from ..scene_export.export import export_steps
from ..settings.option_properties import changed_labels
from . import kept_bakes, lightmap_versions
from .kept_bakes import InMemory
from .kept_sidecars import NO_BAKE, NO_DATA, sidecar_of
from .relight_properties import relight_of
from .relit_images import rewrite
from .relit_materials import refresh_copies

READ, LIT = 0.3, 0.95
"""How far the whole is when the scene is read, and when it is lit."""

Relit = tuple[tuple[LightmapPage, ...], tuple[LightGroup, ...]]


@dataclass(frozen=True)
class RelightReport:
    """What was done: the seconds it took, whether anything had changed, and what is wrong with the result.

    needs_bake: Labels of the options that the panel now has other values of than the bake, which count there.
    """

    seconds: float
    changed: bool
    needs_bake: tuple[str, ...] = ()
    warnings: tuple[BakeWarning, ...] = ()


def run_relight(
    context: bpy.types.Context, in_background: bool = False
) -> Generator[Status, None, RelightReport]:
    """Light the scene's kept bake as its lights are now, and rewrite its lightmaps.

    A generator as `run_bake`; closed, or after an error, everything is as it was.

    Raises
    ------
    RadiosityError
        If nothing was kept, or the scene differs in more than strengths of light; the message says in what.
    """
    started = time.perf_counter()
    lightmap_versions.flush()
    yield Status("export", 0.0)
    held, strengths = yield from staged(strengths_steps(context, in_background), "export", 0.0, 0.0)
    same = np.array_equal(strengths, held.shown)
    (pages, groups), warnings = yield from _lit_in_thread(held.bake, strengths, in_background)
    yield Status("write", LIT)
    mark = kept_bakes.mark_of(context.scene)
    taken = time.perf_counter() - started
    rewrite(mark, pages, groups, taken)
    note_shown(context.scene, held, strengths)
    needs_bake = changed_labels(context.scene.radiosity, held.bake.settings, OF_NO_CONSEQUENCE)
    return RelightReport(time.perf_counter() - started, not same, needs_bake, warnings)


def read_strengths(context: bpy.types.Context) -> tuple[InMemory, Array]:
    """Return the scene's kept bake, from memory or its sidecar, and (s, 3) its sources' strengths now.

    Raises
    ------
    RadiosityError
    """
    return drain(strengths_steps(context))


def strengths_steps(
    context: bpy.types.Context, in_background: bool = False
) -> Generator[float, None, tuple[InMemory, Array]]:
    """Read strengths as `read_strengths`, in steps as those of an export."""
    scene = context.scene
    held = kept_bakes.find(scene)
    stored: KeptBake | StoredBake = stored_bake(scene) if held is None else held.bake
    shown = Originals(context)
    export = yield from export_steps(context, stored.settings, True, in_background, shown)
    if isinstance(stored, StoredBake):
        held = kept_bakes.put(scene, kept_bakes.mark_of(scene), stored.kept(export.bake_scene))
    assert held is not None
    # Undo and redo may have changed it.
    held.shown = noted_strengths(scene, held)
    return held, strengths_in(held.bake, export.bake_scene)


def stored_bake(scene: bpy.types.Scene) -> StoredBake:
    """Return the scene's bake from its sidecar.

    Raises
    ------
    BakeError
        If there is none of this bake.
    """
    mark = kept_bakes.mark_of(scene)
    images = kept_bakes.images_of(mark) if mark else {}
    if not images:
        raise BakeError(NO_BAKE)
    path = sidecar_of(mark)
    if path is None:
        raise BakeError(NO_DATA)
    stored = read_sidecar(path)
    if stored.bake_id != mark:
        raise BakeError(f"'{path}' belongs to another bake: bake again")
    return stored


def lit(kept: KeptBake, strengths: Array, progress: Progress = SILENT) -> Relit:
    """Compute the pages of a kept bake, and those of its light groups."""
    if not are_wanted(kept.bake_scene, kept.settings):
        return relight_pages(kept, strengths, progress), ()
    pages = relight_pages(kept, strengths, progress.part(0.0, 0.5))
    return pages, group_pages(kept, pages, strengths, progress.part(0.5, 1.0))


def _lit_in_thread(
    kept: KeptBake, strengths: Array, in_background: bool
) -> Generator[Status, None, tuple[Relit, tuple[BakeWarning, ...]]]:
    """Do the same in a thread, and warn of noise."""
    status = Status("relight", READ)

    def work(progress: Progress) -> tuple[Relit, tuple[BakeWarning, ...]]:
        relit = lit(kept, strengths, progress.stage("relight", READ, LIT))
        return relit, noise_warnings(*estimated_errors(kept, strengths))

    steps = in_thread(work, in_background)
    try:
        while True:
            try:
                status = next(steps) or status
            except StopIteration as done:
                return done.value
            yield status
    finally:
        steps.close()


def note_shown(scene: bpy.types.Scene, held: InMemory, strengths: Array) -> None:
    """Remember what the lightmaps show, and have emissive surfaces glow so."""
    lights = len(held.bake.sources.lights)
    changed = (strengths != held.shown).any(axis=1)
    names = {name for row, name in enumerate(held.bake.names) if changed[row] and row >= lights}
    if held.bake.settings.quantity != "radiosity":  # there the lightmap itself holds it
        refresh_copies(names)
    held.shown = strengths
    scene.radiosity_relight.strengths = json.dumps(strengths.tolist())


def noted_strengths(scene: bpy.types.Scene, held: InMemory) -> Array:
    """Return the strengths that the scene says its lightmaps show: those of the bake if it says none."""
    try:
        noted = np.array(json.loads(relight_of(scene).strengths), dtype=np.float64)
    except (ValueError, TypeError):
        return held.bake.strengths
    return noted if noted.shape == held.bake.strengths.shape else held.bake.strengths
