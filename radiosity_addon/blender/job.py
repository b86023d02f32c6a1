"""One bake from the open scene to lit materials: what the panel and the command line both run."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace

import bpy

from ..background import in_thread
from ..bake_scene import BakeResult, Progress
from ..keeping import Keeping, bake_steps, moves_alone
from ..relighting import KeptBake
from ..report import BakeReport
from ..settings import BakeSettings
from ..sidecar import sidecar_entry
from ..sidecar_names import KEPT, SIDECAR_NAME
from ..solver.arrays import Array
from . import kept_bakes, kept_details, lightmap_versions, runtime
from .apply import apply_lightmaps, check_targets
from .bake_record import remove_datablocks
from .export import export_scene
from .export_sources import Export
from .group_images import GroupImages, each_image, write_groups
from .images import lightmap_files, relative_path, set_folder, write_pages
from .light_shares import crowded_materials
from .live_picture import Seen, seen_triangles
from .only_changed import Kept as Others
from .only_changed import narrow, remember
from .output import BLEND_NAME, PREVIEW_NAME, REPORT_NAME, OutputFolder, save_copy
from .preview import SAMPLES, render_preview
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
    keeping: Keeping | None = None,
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
    keeping : Keeping or None
        If given, the bake is kept for relighting: in memory, and in a sidecar if that is asked for.
    only_changed : bool
        Give new lightmaps to what has changed since the last bake, see `only_changed.py`, which cannot be
        kept then; if things have only moved since a bake that was kept, all lightmaps follow.

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
    lightmap_versions.flush()
    with ExitStack() as stack:
        if output is not None:
            # Opened first: a folder that cannot be written is no news for after the work.
            stack.enter_context(output)
        yield Progress("export", 0.0)
        with timed(seconds, "export"), originals_shown(context) as edited:
            export = export_scene(context, settings, dark=keeping is not None)
            check_targets(export)
            seen = seen_triangles(context, export)
        others = Others()
        if only_changed and not moves_alone(export.bake_scene, settings, keeping):
            export, settings, others = narrow(context.scene, export, settings)
            keeping = None if others.objects else keeping
        solved = APPLY if with_copy else APPLY_ALONE
        sidecar = output.staging / SIDECAR_NAME if output and keeping and keeping.sidecar else None
        steps = bake_steps(export.bake_scene, settings, keeping, sidecar)
        result, kept = yield from _solve(steps, seen, patient, solved)
        result = replace(result, warnings=(*edited, *others.warnings(), *result.warnings))
        seconds.update(result.seconds)
        yield Progress("apply", solved)
        if with_copy and output is not None:
            return (yield from deliver(context, settings, export, result, output, seconds, keeping))
        with replacing_earlier(context, others.objects), timed(seconds, "apply"):
            images, groups = _show(context, settings, export, result, output, keeping, others.files)
            report = _report(result, images, groups, settings, seconds)
            if output is not None:
                whole = report.joined(output.path / REPORT_NAME, others.objects)
                whole = keeping_sidecar(whole, output, keeping)
                whole.listing(output.files()).write(output.staging / REPORT_NAME)
                lightmap_versions.hold(output)
                output.publish()
            remember(context.scene, export, result, wanted)
        folder = "" if output is None else relative_path(output.path)
        runtime.remember(context.scene, report.as_dict(), folder)
        _remember_kept(context.scene, keeping, kept)
        lightmap_versions.check()
        kept_details.keep(context.scene, result, [image.name for image in images])
    return report


def _solve(
    baking: Generator[Progress, None, tuple[BakeResult, KeptBake | None]],
    seen: Array,
    patient: bool,
    end: float,
) -> Generator[Progress, None, tuple[BakeResult, KeptBake | None]]:
    """Run the pipeline, its progress scaled to its share of the whole, its pictures to what is `seen`."""
    steps = in_thread(baking) if patient else baking
    shown, only = Progress("unwrap", SOLVE), Seen(seen)
    try:
        while True:
            try:
                progress = next(steps)
            except StopIteration as done:
                return done.value
            picture = texels = None
            if progress is not None:
                shown = Progress(progress.stage, SOLVE + (end - SOLVE) * progress.fraction)
                picture, texels = only.of_elements(progress.picture), only.of_texels(progress.texels)
            # Each picture comes once, however long the step after it takes.
            yield replace(shown, picture=picture, texels=texels)
    finally:
        steps.close()


def _remember_kept(scene: bpy.types.Scene, keeping: Keeping | None, kept: KeptBake | None) -> None:
    """Keep the bake with its scene; the one before it is gone whether this one is kept or not."""
    kept_bakes.drop(scene)
    if keeping is not None:
        kept_bakes.set_mark(scene, keeping.mark)
        if kept is not None:
            kept_bakes.put(scene, keeping.mark, kept)


def deliver(
    context: bpy.types.Context,
    settings: BakeSettings,
    export: Export,
    result: BakeResult,
    output: OutputFolder,
    seconds: dict[str, float],
    keeping: Keeping | None,
    samples: int = SAMPLES,
) -> BakeJob:
    """Show the lightmaps, save the scene beside them, render it, and publish all at once."""
    with replacing_earlier(context), timed(seconds, "apply"):
        images, groups = _show(context, settings, export, result, output, keeping)
    try:
        # The copy tells of its bake too; what is left to do is not in its times.
        so_far = _report(result, images, groups, settings, seconds)
        runtime.remember(context.scene, so_far.as_dict(), "//")
        _remember_kept(context.scene, keeping, None)
        yield Progress("save", SAVE)
        with timed(seconds, "save"):
            save_copy(output.staging / BLEND_NAME, output.path)
        yield Progress("preview", PREVIEW)
        with timed(seconds, "preview"):
            render_preview(context, output.staging / PREVIEW_NAME, settings, samples)
        report = keeping_sidecar(_report(result, images, groups, settings, seconds), output, keeping)
        report = report.listing(output.files())
        report.write(output.staging / REPORT_NAME)
        yield Progress("write", 1.0)
        output.publish()
    except BaseException:
        restore(context)
        runtime.forget(context.scene)
        kept_bakes.drop(context.scene)
        raise
    return report


def _show(
    context: bpy.types.Context,
    settings: BakeSettings,
    export: Export,
    result: BakeResult,
    output: OutputFolder | None,
    keeping: Keeping | None,
    taken: frozenset[str] = frozenset(),
) -> tuple[list[bpy.types.Image], GroupImages]:
    """Make the images, also those of light groups, and put them on the objects; files `taken` stay."""
    folder = None if output is None else output.staging
    images = write_pages(result, settings, folder, taken)
    groups: GroupImages = {}
    try:
        groups = write_groups(result, settings, folder)
        lightmap_versions.mark([*images, *each_image(groups)])
        if output is not None:
            set_folder([*images, *each_image(groups)], output.path)
        if keeping is not None:
            kept_bakes.mark_images([*images, *each_image(groups)], keeping.mark)
        apply_lightmaps(context, export, result, images, settings, groups)
        seal()
    except BaseException:
        remove_datablocks([*images, *each_image(groups)])
        raise
    return images, groups


def _report(
    result: BakeResult,
    images: list[bpy.types.Image],
    groups: GroupImages,
    settings: BakeSettings,
    seconds: dict[str, float],
) -> BakeReport:
    """Report a bake and its files."""
    shares = [lightmap_files(of, settings) for of in groups.values()]
    if groups:
        result = replace(result, warnings=(*result.warnings, *crowded_materials()))
    return BakeReport.of(result, lightmap_files(images, settings), seconds, shares)


def keeping_sidecar(report: BakeReport, output: OutputFolder, keeping: Keeping | None) -> BakeReport:
    """Return the report with what proves that a sidecar, if the bake is kept in one, belongs to it."""
    if keeping is None or not keeping.sidecar:
        return report
    staged = output.staging / SIDECAR_NAME
    path = staged if staged.is_file() else output.path / SIDECAR_NAME
    return BakeReport({**report.data, KEPT: sidecar_entry(path, keeping.mark)})


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Add what the block takes to a stage's time."""
    start = time.perf_counter()
    yield
    seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - start
