"""One bake from the open scene to lit materials: what the panel and the command line both run."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace

import bpy

from .. import pipeline
from ..background import in_thread
from ..bake_scene import BakeResult, Progress
from ..report import BakeReport
from ..settings import BakeSettings
from ..solver.arrays import Array
from . import runtime
from .apply import apply_lightmaps, check_targets
from .bake_record import remove_datablocks
from .export import export_scene
from .export_sources import Export
from .images import lightmap_files, relative_path, set_folder, write_pages
from .live_picture import seen_triangles
from .only_changed import Kept, narrow, remember
from .output import BLEND_NAME, PREVIEW_NAME, REPORT_NAME, OutputFolder, save_copy
from .preview import render_preview
from .rebake import originals_shown, replacing_earlier, seal
from .restore import restore

BakeJob = Generator[Progress, None, BakeReport]

# How far the whole is when each part begins; rough, from bakes at medium quality.
SOLVE, APPLY, SAVE, PREVIEW = 0.03, 0.85, 0.89, 0.92

APPLY_ALONE = 0.98
"""How far it is when applying begins, where neither a copy nor a preview is written."""

WRITING_STAGES = frozenset({"apply", "save", "preview", "write"})
"""Stages in which an exception from outside, such as Ctrl-C, would be lost or do harm."""


def run_bake(
    context: bpy.types.Context,
    settings: BakeSettings,
    output: OutputFolder | None,
    with_copy: bool = False,
    patient: bool = False,
    only_changed: bool = False,
) -> BakeJob:
    """Bake the context's scene and show the lightmaps on its objects.

    A generator: each `next` does a piece of the work, so that a window stays alive.
    Closing it, or an error, leaves the scene and the output folder as they were; an earlier
    bake stays in place until the new one has succeeded. (Only a failure while the copy or
    the preview is written comes too late for that: it leaves the originals.)

    Parameters
    ----------
    context : Context
    settings : BakeSettings
    output : OutputFolder or None
        None packs the lightmaps into the file and writes nothing.
    with_copy : bool
        Write `baked.blend` and `preview.png` into the output folder as well.
    patient : bool
        Return from every `next` within a moment, for a window: the steps between the
        export and the lightmaps, which know nothing of Blender, run in a thread.
    only_changed : bool
        Give new lightmaps to what has changed since the last bake, see `only_changed.py`.

    Yields
    ------
    progress : Progress
        The stage that begins or goes on. A picture holds what the viewports show as surfaces.

    Returns
    -------
    report : BakeReport

    Raises
    ------
    RadiosityError
        Whatever cannot be baked or written, in one line.
    """
    seconds: dict[str, float] = {}
    wanted = settings
    with ExitStack() as stack:
        if output is not None:
            # Opened first: a folder that cannot be written is no news for after the work.
            stack.enter_context(output)
        yield Progress("export", 0.0)
        with _timed(seconds, "export"), originals_shown(context) as edited:
            export = export_scene(context, settings)
            check_targets(export)
            seen = seen_triangles(context, export)
        kept = Kept()
        if only_changed:
            export, settings, kept = narrow(context.scene, export, settings)
        solved = APPLY if with_copy else APPLY_ALONE
        result = yield from _solve(export, settings, seen, patient, solved)
        result = replace(result, warnings=(*edited, *kept.warnings(), *result.warnings))
        seconds.update(result.seconds)
        yield Progress("apply", solved)
        if with_copy and output is not None:
            return (yield from _deliver(context, settings, export, result, output, seconds))
        with replacing_earlier(context, kept.objects), _timed(seconds, "apply"):
            images = _show(context, settings, export, result, output, kept)
            report = BakeReport.of(result, lightmap_files(images, settings), seconds)
            if output is not None:
                whole = report.joined(output.path / REPORT_NAME, kept.objects)
                whole.listing(output.files()).write(output.staging / REPORT_NAME)
                output.publish()
            remember(context.scene, export, result, wanted)
        runtime.remember(
            context.scene, report.as_dict(), "" if output is None else relative_path(output.path)
        )
    return report


def _solve(
    export: Export, settings: BakeSettings, seen: Array, patient: bool, end: float
) -> Generator[Progress, None, BakeResult]:
    """Run the pipeline, its progress scaled to its share of the whole, its pictures to what is `seen`."""
    baking = pipeline.bake(export.bake_scene, settings)
    steps = in_thread(baking) if patient else baking
    shown = Progress("unwrap", SOLVE)
    try:
        while True:
            try:
                progress = next(steps)
            except StopIteration as done:
                return done.value
            picture = None
            if progress is not None:
                shown = Progress(progress.stage, SOLVE + (end - SOLVE) * progress.fraction)
                picture = progress.picture
            # Each picture comes once, however long the step after it takes.
            yield shown if picture is None else replace(shown, picture=picture.only(seen[picture.triangle]))
    finally:
        steps.close()


def _deliver(
    context: bpy.types.Context,
    settings: BakeSettings,
    export: Export,
    result: BakeResult,
    output: OutputFolder,
    seconds: dict[str, float],
) -> BakeJob:
    """Show the lightmaps, save the scene beside them, render it, and publish all at once."""
    with replacing_earlier(context), _timed(seconds, "apply"):
        images = _show(context, settings, export, result, output)
    try:
        # The copy tells of its bake too; what is left to do is not in its times.
        so_far = BakeReport.of(result, lightmap_files(images, settings), seconds)
        runtime.remember(context.scene, so_far.as_dict(), "//")
        yield Progress("save", SAVE)
        with _timed(seconds, "save"):
            save_copy(output.staging / BLEND_NAME, output.path)
        yield Progress("preview", PREVIEW)
        with _timed(seconds, "preview"):
            render_preview(context, output.staging / PREVIEW_NAME, settings)
        report = BakeReport.of(result, lightmap_files(images, settings), seconds)
        report.listing(output.files()).write(output.staging / REPORT_NAME)
        yield Progress("write", 1.0)
        output.publish()
    except BaseException:
        restore(context)
        runtime.forget(context.scene)
        raise
    return report


def _show(
    context: bpy.types.Context,
    settings: BakeSettings,
    export: Export,
    result: BakeResult,
    output: OutputFolder | None,
    kept: Kept | None = None,
) -> list[bpy.types.Image]:
    """Make the images and put them on the objects; files of what is kept stay."""
    others = frozenset() if kept is None else kept.files
    images = write_pages(result, settings, None if output is None else output.staging, others)
    try:
        if output is not None:
            set_folder(images, output.path)
        apply_lightmaps(context, export, result, images, settings)
        seal()
    except BaseException:
        remove_datablocks(images)
        raise
    return images


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Add what the block takes to a stage's time."""
    start = time.perf_counter()
    yield
    seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - start
