"""One bake from the open scene to lit materials: what the panel and the command line both run."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, replace

import bpy

from ...bake import KeepOptions, moves_alone, pages_of, refuse_too_large, run_pipeline, timed
from ...bake.relight import KeptBake
from ...bake.result import BakeReport, BakeResult
from ...bake.sidecar import sidecar_entry
from ...base import BakeWarning, Progress, Status, staged
from ...files import BLEND_NAME, KEPT, PLAIN_NAMES, PREVIEW_NAME
from ...numerics import Array
from ...options import BakeSettings
from ..apply.apply import apply_steps, check_targets
from ..apply.only_changed import gone_objects, kept_warning, remember, restrict_to_changed
from ..apply.rebake import EarlierBake, Originals, replacing_earlier
from ..apply.restore import restore
from ..apply.scopes import files_shown_by, keeping_theirs, of_scene, shared_warnings
from ..datablocks.bake_record import remove_datablocks
from ..files.output import OutputFolder
from ..files.saved_files import save_copy
from ..images.group_images import GroupImages, each_image, write_groups
from ..images.images import lightmap_files, possible_names, relative_path, set_folder, write_pages
from ..material_copies.light_shares import crowded_materials
from ..relight import kept_bakes, lightmap_versions
from ..scene_export.export import export_steps
from ..scene_records.export_sources import Export
from ..session import kept_details, runtime
from ..session.background import in_thread
from .live_picture import Seen, seen_triangles
from .preview import SAMPLES, render_preview

BakeJob = Generator[Status, None, BakeReport]
Shown = tuple[list[bpy.types.Image], GroupImages, tuple[BakeWarning, ...]]

# How far the whole is when each part begins; rough, from bakes at medium quality.
SOLVE, APPLY, SAVE, PREVIEW = 0.03, 0.85, 0.89, 0.92

APPLY_ALONE = 0.98
"""How far it is when applying begins, where neither a copy nor a preview is written."""

WRITING_STAGES = frozenset({"apply", "save", "preview", "write"})
"""Stages in which an exception from outside, such as Ctrl-C, would be lost or do harm."""


@dataclass(frozen=True)
class Scope:
    """Which objects keep the lightmaps of earlier bakes: all those, those of the scene that is baked.

    `is_partial` says that only some of the scene's objects are baked.
    """

    keep: frozenset[str] = frozenset()
    in_scene: tuple[str, ...] = ()
    is_partial: bool = False

    @classmethod
    def of(cls, scene: bpy.types.Scene, export: Export, is_partial: bool) -> Scope:
        """Return the scope of a bake."""
        keep = keeping_theirs(scene, export, is_partial)
        return cls(keep, tuple(of_scene(keep, scene)), is_partial)

    def replacing_earlier(self, context: bpy.types.Context) -> AbstractContextManager[EarlierBake]:
        """Replace the earlier bake of all other objects."""
        return replacing_earlier(context, self.keep, self.is_partial)


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
    in_background : bool
        Return from every `next` within a moment, for a window: the steps between the
        export and the lightmaps, which know nothing of Blender, run in a thread.
    keeping : KeepOptions or None
        If given, the bake is kept for relighting: in memory, and in a sidecar if that is asked for.
    only_changed : bool
        Give new lightmaps to what has changed since the last bake, see `only_changed.py`, which cannot be
        kept then; if things have only moved since a bake that was kept, all lightmaps follow.
    notes : tuple of BakeWarning
        What is known before the bake and belongs into its report.
    with_preview : bool
        False leaves `preview.png` out.

    Yields
    ------
    status : Status
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
    # Now, not after the export: large pages need much memory whatever is on them.
    refuse_too_large(pages_of(settings) or (), settings)
    lightmap_versions.flush()
    with ExitStack() as stack:
        if output is not None:
            # First: a folder that cannot be written, or holds files of others, is no news for after the work.
            stack.enter_context(output)
        yield Status("export", 0.0)
        if output is not None:
            preview = (PREVIEW_NAME,) if with_preview else ()
            copies = (BLEND_NAME, *preview) if with_copy else ()
            sidecars = (output.names.sidecar,) if keeping and keeping.sidecar else ()
            for _ in output.expecting((*copies, *sidecars)):
                yield Status("export", 0.0)
        originals = Originals(context)
        with timed(seconds, "export"):
            steps = export_steps(context, settings, keeping is not None, in_background, originals)
            export = yield from staged(steps, "export", 0.0, 0.0)
            yield Status("export", 0.0)
            with originals():
                context.view_layer.update()
                check_targets(export)
                seen = seen_triangles(context, export)
        unchanged = 0
        if only_changed and not moves_alone(export.bake_scene, settings, keeping):
            export, settings, unchanged = restrict_to_changed(context.scene, export, settings)
        scope = Scope.of(context.scene, export, is_partial=settings.objects is not None or unchanged > 0)
        remarks = [*notes, *originals.warnings, *shared_warnings(context.scene, export)]
        if unchanged:
            remarks.append(kept_warning(unchanged, gone_objects(context.scene, export.bake_scene)))
        elif scope.in_scene and keeping is not None:
            remarks.append(_cannot_relight(len(scope.in_scene)))
        keeping = None if scope.in_scene else keeping
        if output is not None:
            shown = files_shown_by(scope.keep)
            lightmaps = possible_names(output.names, settings, export.bake_scene, output.path, shown)
            for _ in output.expecting(lightmaps):
                yield Status("export", SOLVE)
        solved = APPLY if with_copy else APPLY_ALONE
        sidecar = output.staging / output.names.sidecar if output and keeping and keeping.sidecar else None
        scene = export.bake_scene

        def baking(progress: Progress) -> tuple[BakeResult, KeptBake | None]:
            return run_pipeline(scene, settings, keeping, sidecar, progress)

        result, kept = yield from _solve(baking, seen, in_background, solved)
        result = replace(result, warnings=(*remarks, *result.warnings))
        seconds.update(result.seconds)
        yield Status("apply", solved)
        if with_copy and output is not None:
            delivered = deliver(
                context,
                settings,
                export,
                result,
                output,
                seconds=seconds,
                keeping=keeping,
                samples=SAMPLES if with_preview else None,
                scope=scope,
            )
            return (yield from delivered)
        with scope.replacing_earlier(context) as earlier, timed(seconds, "apply"):
            result = replace(result, warnings=(*earlier.warnings, *result.warnings))
            showing = _show(context, settings, export, result, output, keeping, earlier)
            images, groups, behind = yield from staged(showing, "apply", solved, 1.0)
            result = replace(result, warnings=(*behind, *result.warnings))
            report = _report(result, images, groups, settings, seconds)
            if output is not None:
                whole = report.joined(output.earlier, earlier.kept_sources)
                output.write_report(keeping_sidecar(whole, output, keeping))
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
    baking: Callable[[Progress], tuple[BakeResult, KeptBake | None]],
    seen: Array,
    in_background: bool,
    end: float,
) -> Generator[Status, None, tuple[BakeResult, KeptBake | None]]:
    """Run the pipeline, its progress scaled to its share of the whole, its pictures to what is `seen`."""
    steps = in_thread(lambda progress: baking(progress.part(SOLVE, end)), in_background)
    status, only = Status("unwrap", SOLVE), Seen(seen)
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


def _remember_kept(scene: bpy.types.Scene, keeping: KeepOptions | None, kept: KeptBake | None) -> None:
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
    keeping: KeepOptions | None,
    samples: int | None = SAMPLES,
    scope: Scope | None = None,
) -> BakeJob:
    """Show the lightmaps, save the scene beside them, render it unless `samples` is None, and publish it."""
    with (scope or Scope()).replacing_earlier(context) as earlier, timed(seconds, "apply"):
        result = replace(result, warnings=(*earlier.warnings, *result.warnings))
        showing = _show(context, settings, export, result, output, keeping, earlier)
        images, groups, behind = yield from staged(showing, "apply", APPLY, SAVE)
        result = replace(result, warnings=(*behind, *result.warnings))
    try:
        # The copy tells of its bake too; what is left to do is not in its times.
        so_far = _report(result, images, groups, settings, seconds)
        runtime.remember(context.scene, so_far.as_dict(), "//")
        _remember_kept(context.scene, keeping, None)
        yield Status("save", SAVE)
        with timed(seconds, "save"):
            save_copy(output)
        if samples is not None:
            yield Status("preview", PREVIEW)
            with timed(seconds, "preview"):
                render_preview(context, output.staging / PREVIEW_NAME, settings, samples)
        report = _report(result, images, groups, settings, seconds)
        report = output.write_report(keeping_sidecar(report, output, keeping))
        yield Status("write", 1.0)
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
    keeping: KeepOptions | None,
    earlier: EarlierBake,
) -> Generator[float, None, Shown]:
    """Make the images, also those of light groups, and put them on the objects; yields the fraction done."""
    folder, names = (None, PLAIN_NAMES) if output is None else (output.staging, output.names)
    # Which instances keep theirs is found out later.
    taken = files_shown_by(earlier.keep, earlier.stand_ins.values() if earlier.is_partial else ())
    images = write_pages(result, settings, folder, taken, names)
    groups: GroupImages = {}
    try:
        groups = write_groups(result, settings, folder, taken, names)
        lightmap_versions.mark([*images, *each_image(groups)], names.report)
        if output is not None:
            set_folder([*images, *each_image(groups)], output.path)
        if keeping is not None:
            kept_bakes.mark_images([*images, *each_image(groups)], keeping.mark)
        behind = yield from apply_steps(context, export, result, images, settings, groups, earlier)
    except BaseException:
        remove_datablocks([*images, *each_image(groups)])
        raise
    return images, groups, behind


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


def keeping_sidecar(report: BakeReport, output: OutputFolder, keeping: KeepOptions | None) -> BakeReport:
    """Return the report with what proves that a sidecar, if the bake is kept in one, belongs to it."""
    if keeping is None or not keeping.sidecar:
        return report
    staged = output.staging / output.names.sidecar
    path = staged if staged.is_file() else output.path / output.names.sidecar
    return BakeReport({**report.data, KEPT: sidecar_entry(path, keeping.mark)})
