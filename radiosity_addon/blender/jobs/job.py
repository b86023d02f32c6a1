"""One bake from the open scene to lit materials: what the panel and the command line both run."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial

import bpy

from ...bake import (
    BakePlan,
    Baking,
    KeepOptions,
    pages_of,
    plan_bake,
    refuse_bake,
    refuse_large_pages,
    run_pipeline,
    timed,
)
from ...bake.relight import KeptBake
from ...bake.result import BakeResult
from ...base import BakeWarning, NothingToDoError, Progress, Status, in_thread, staged
from ...files import BLEND_NAME, PREVIEW_NAME
from ...numerics import Array
from ...options import BakeSettings
from ..apply.apply import check_targets
from ..apply.face_flips import found_faces
from ..apply.rebake import Originals
from ..apply.scopes import files_shown_by, shared_warnings
from ..apply.shown_bake import shown_bake
from ..files.output import OutputFolder
from ..images.images import possible_names
from ..relight import lightmap_versions
from ..scene_export.export import export_steps
from ..scene_records.export_sources import Export
from ..session.turned_faces import TurnedFaces
from .finish import BakeJob, Copies, Scope, applying, finish
from .live_picture import ViewportFilter, seen_triangles
from .preview import SAMPLES

SOLVE = 0.03
"""How far the whole is when the scene has been read; rough."""


def _cannot_relight(count: int) -> BakeWarning:
    message = (
        f"{count} objects that were not baked keep their lightmaps; "
        "to relight the scene, bake all of its objects"
    )
    return BakeWarning("scene", message)


def run_bake(
    context: bpy.types.Context,
    settings: BakeSettings,
    output: OutputFolder | None,
    with_copy: bool = False,
    in_background: bool = False,
    keeping: KeepOptions | None = None,
    only_changed: bool = False,
    notes: tuple[BakeWarning, ...] = (),
    with_preview: bool = True,
    baking: Baking | None = None,
) -> BakeJob:
    """Bake the context's scene and show the lightmaps on its objects.

    A generator: each `next` does a piece of the work, so that a window stays alive.
    Closing it, or an error, leaves the scene and the output folder as they were; an earlier
    bake stays in place until the new one has succeeded. (Only a failure while the copy or
    the preview is written comes too late for that: it leaves the originals.)

    output: None packs the lightmaps into the file and writes nothing.
    with_copy: Write `baked.blend` and `preview.png` into the output folder as well.
    in_background: Return from every `next` within a moment, for a window: the steps between the export and
        the lightmaps, which know nothing of Blender, run in a thread.
    keeping: If given, the bake is kept for relighting: in memory, and in a sidecar if requested.
    only_changed: Give new lightmaps to objects that changed since the last bake; the bake cannot be kept
        then. If objects have only moved since a bake that was kept, all lightmaps follow (`bake/plan.py`).
    notes: What is known before the bake and belongs into its report.
    with_preview: False leaves `preview.png` out.
    baking: Takes the pipeline's place, in its thread.
    Yields status: The stage that begins or goes on. A picture holds what the viewports show as surfaces.
    Raises RadiosityError: Whatever cannot be baked or written, in one line.
    """
    seconds: dict[str, float] = {}
    _begin(settings)
    with ExitStack() as stack:
        if output is not None:
            # First: a folder that cannot be written, or holds files of others, is no news for after the work.
            stack.enter_context(output)
        yield Status("export", 0.0)
        if output is not None:
            preview = (PREVIEW_NAME,) if with_preview else ()
            own_copies = (BLEND_NAME, *preview) if with_copy else ()
            sidecars = (output.names.sidecar,) if keeping and keeping.sidecar else ()
            for _ in output.expecting((*own_copies, *sidecars)):
                yield Status("export", 0.0)
        with timed(seconds, "export"):
            planned = yield from _planned(context, settings, keeping, only_changed, in_background)
        plan, scope, export, keeping = planned.plan, planned.scope, planned.export, planned.keeping
        if output is not None:
            shown = files_shown_by(scope.keep)
            lightmaps = possible_names(output.names, plan.settings, plan.bake_scene, output.path, shown)
            for _ in output.expecting(lightmaps):
                yield Status("export", SOLVE)
        copies = Copies(SAMPLES if with_preview else None) if with_copy and output is not None else None
        sidecar = output.staging / output.names.sidecar if output and keeping and keeping.sidecar else None
        solved, _ = applying(copies)
        work = partial(baking or run_pipeline, plan, keeping, sidecar)
        result, kept = yield from _solve(work, planned.seen, in_background, solved)
        result = replace(result, warnings=(*notes, *planned.warnings, *result.warnings))
        seconds.update(result.seconds)
        yield Status("apply", solved)
        finished = finish(
            context,
            plan.settings,
            export,
            result,
            output,
            digests=plan.digests,
            seconds=seconds,
            keeping=keeping,
            kept=kept,
            scope=scope,
            copies=copies,
        )
        return (yield from finished)


def prepare_bake(
    context: bpy.types.Context, settings: BakeSettings, keeping: KeepOptions | None
) -> Generator[Status, None, PlannedBake]:
    """Export the context's scene and plan its bake, without baking; the scene stays as it was.

    Raises RadiosityError: Whatever a bake would refuse before it begins to unwrap.
    """
    _begin(settings)
    yield Status("export", 0.0)
    planned = yield from _planned(context, settings, keeping)
    yield Status("export", 1.0)
    plan = planned.plan
    refuse_bake(plan.bake_scene, plan.settings, keep=planned.keeping is not None)
    return planned


def find_turned_faces(
    context: bpy.types.Context, settings: BakeSettings
) -> Generator[Status, None, tuple[tuple[TurnedFaces, ...], tuple[BakeWarning, ...]]]:
    """Bake the context's scene, neither showing nor writing the result.

    Returns faces that show their backs, and what the bake warns of.
    Raises RadiosityError: Whatever cannot be baked.
    """
    _begin(settings)
    yield Status("export", 0.0)
    planned = yield from _planned(context, settings, None)
    result, _ = yield from _solve(partial(run_pipeline, planned.plan, None, None), planned.seen, False, 1.0)
    warnings = (*planned.warnings, *result.warnings)
    return found_faces(warnings, planned.export.bake_scene.objects, planned.export.sources), warnings


@dataclass(frozen=True, eq=False)
class PlannedBake:
    """A scene that was exported, and what of it is to be baked.

    keeping: How the bake is kept, if it can be.
    warnings: What is known before the bake.
    seen: The triangles that viewports show.
    """

    export: Export
    plan: BakePlan
    scope: Scope
    keeping: KeepOptions | None
    warnings: tuple[BakeWarning, ...]
    seen: Array


def _begin(settings: BakeSettings) -> None:
    """Refuse pages that are too large now, not after the export, and write lightmaps that wait for it."""
    refuse_large_pages(pages_of(settings) or (), settings)
    lightmap_versions.flush()


def _planned(
    context: bpy.types.Context,
    settings: BakeSettings,
    keeping: KeepOptions | None,
    only_changed: bool = False,
    in_background: bool = False,
) -> Generator[Status, None, PlannedBake]:
    """Export the scene and plan its bake."""
    originals = Originals(context)
    steps = export_steps(context, settings, keeping is not None, in_background, originals)
    export = yield from staged(steps, "export", 0.0, 0.0)
    yield Status("export", 0.0)
    with originals():
        context.view_layer.update()
        check_targets(export)
        seen = seen_triangles(context, export)
    plan, scope, cannot_keep = _plan(context.scene, export, settings, keeping, only_changed)
    export = replace(export, bake_scene=plan.bake_scene)
    shared = shared_warnings(context.scene, export)
    warnings = (*originals.warnings, *shared, *plan.warnings, *cannot_keep)
    return PlannedBake(export, plan, scope, None if scope.in_scene else keeping, warnings, seen)


def _plan(
    scene: bpy.types.Scene,
    export: Export,
    settings: BakeSettings,
    keeping: KeepOptions | None,
    only_changed: bool,
) -> tuple[BakePlan, Scope, tuple[BakeWarning, ...]]:
    """Return which bake the scene needs, which objects keep their lightmaps, and why it cannot be kept.

    Raises NothingToDoError if nothing has changed.
    """
    scope = Scope.of(scene, export, is_partial=settings.objects is not None)
    kept = None if keeping is None or scope.in_scene else keeping.earlier
    shown = shown_bake(scene, export) if only_changed else None
    plan = plan_bake(export.bake_scene, settings, shown, kept)
    if plan.kind == "nothing":
        raise NothingToDoError(plan.reason)
    if plan.kind == "changed":
        return plan, Scope.of(scene, replace(export, bake_scene=plan.bake_scene), is_partial=True), ()
    cannot_keep = scope.in_scene and keeping is not None
    return plan, scope, (_cannot_relight(len(scope.in_scene)),) if cannot_keep else ()


def _solve(
    baking: Callable[[Progress], tuple[BakeResult, KeptBake | None]],
    seen: Array,
    in_background: bool,
    end: float,
) -> Generator[Status, None, tuple[BakeResult, KeptBake | None]]:
    """Run the pipeline, its progress scaled to its share of the whole, its pictures to what is `seen`."""
    steps = in_thread(lambda progress: baking(progress.part(SOLVE, end)), in_background)
    status, only = Status("unwrap", SOLVE), ViewportFilter(seen)
    try:
        while True:
            try:
                news = next(steps)
            except StopIteration as done:
                return done.value
            # Each picture comes once, however long the step after it takes.
            status = replace(status, picture=None)
            if news is not None:
                status = replace(news, picture=only.of(news.picture))
            yield status
    finally:
        steps.close()
