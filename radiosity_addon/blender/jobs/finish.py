"""The end of every bake and relight: show the lightmaps, remember, save and render copies, report, publish.

Panel and command line end in this order. A failure takes back what came before it.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace

import bpy

from ...bake import BakeDigests, KeepOptions, timed
from ...bake.relight import KeptBake
from ...bake.result import BakeReport, BakeResult
from ...bake.sidecar import sidecar_entry
from ...base import BakeWarning, Status, staged
from ...files import KEPT, PLAIN_NAMES, PREVIEW_NAME
from ...options import BakeSettings
from ..apply.apply import apply_steps
from ..apply.face_flips import found_faces
from ..apply.rebake import EarlierBake, replacing_earlier
from ..apply.restore import restore
from ..apply.scopes import files_shown_by, keeping_theirs, of_scene
from ..apply.shown_bake import forget_content, remember, remember_content
from ..datablocks.bake_record import remove_datablocks
from ..files.output import OutputFolder
from ..files.saved_files import save_copy
from ..images.group_images import GroupImages, each_image, write_groups
from ..images.images import lightmap_files, relative_path, set_folder, write_pages
from ..material_copies.light_shares import crowded_materials
from ..relight import kept_bakes, lightmap_versions
from ..scene_records.export_sources import Export
from ..session import kept_details, last_bake
from ..settings.properties import looks_put_back, show_look_of
from .preview import SAMPLES, render_preview

BakeJob = Generator[Status, None, BakeReport]
Shown = tuple[list[bpy.types.Image], GroupImages, tuple[BakeWarning, ...]]

SHOWN, COPIED, PREVIEWED = (0.98, 1.0), (0.96, 0.98), (0.85, 0.89)
"""How far the whole is when applying begins and ends: without copies, with a copy of the file, and with a
preview of it; rough, at medium quality."""

PREVIEW = 0.92
"""How far it is when the preview begins."""

WRITING_STAGES = frozenset({"apply", "save", "preview", "write"})
"""Stages in which an exception from outside, such as Ctrl-C, would be lost or do harm."""

_MEMORY = {
    "radiosity": last_bake.MEMORY,
    "radiosity_relight": ("mark", "strengths"),
}
"""What a scene remembers of its bake, by property group."""


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


@dataclass(frozen=True)
class Copies:
    """What is written next to the lightmaps: `baked.blend`, and `preview.png` unless `samples` is None."""

    samples: int | None = SAMPLES


def applying(copies: Copies | None) -> tuple[float, float]:
    """Return how far the whole bake is when applying begins and ends."""
    if copies is None:
        return SHOWN
    return COPIED if copies.samples is None else PREVIEWED


def finish(
    context: bpy.types.Context,
    settings: BakeSettings,
    export: Export,
    result: BakeResult,
    output: OutputFolder | None,
    *,
    digests: BakeDigests,
    seconds: dict[str, float],
    keeping: KeepOptions | None,
    kept: KeptBake | None = None,
    scope: Scope | None = None,
    copies: Copies | None = None,
) -> BakeJob:
    """Show a bake's lightmaps on the objects and publish its files.

    A failure leaves the earlier bake in place; while copies are written, it leaves the originals.

    Parameters
    ----------
    context : Context
    settings : BakeSettings
        Those of the bake.
    export : Export
    result : BakeResult
    output : OutputFolder or None
        None packs the lightmaps into the file.
    digests : BakeDigests
        What scene and objects are to remember.
    seconds : dict of str to float
        Times of the stages so far; those of the end are added.
    keeping : KeepOptions or None
    kept : KeptBake or None
        To be kept in memory.
    scope : Scope or None
        None replaces all lightmaps.
    copies : Copies or None
        None writes no copies; they need an output.
    """
    scene = context.scene
    with looks_put_back(), ExitStack() as undo:
        undo.enter_context(_memory_put_back(scene))
        earlier = undo.enter_context((scope or Scope()).replacing_earlier(context))
        with timed(seconds, "apply"):
            result = replace(result, warnings=(*earlier.warnings, *result.warnings))
            showing = _show(context, settings, export, result, output, keeping, earlier)
            images, groups, warnings = yield from staged(showing, "apply", *applying(copies))
            result = replace(result, warnings=(*warnings, *result.warnings))
        # A copy remembers its bake too; the time that is left to do is not in its figures.
        report = _report(result, images, groups, settings, seconds)
        keeps_some = scope is not None and bool(scope.in_scene)
        remember(scene, export, result, digests, settings, is_partial=keeps_some)
        folder = "" if output is None else "//" if copies else relative_path(output.path)
        turned = found_faces(result.warnings, export.bake_scene.objects, export.sources)
        last_bake.remember(scene, report.as_dict(), folder, turned)
        kept_bakes.note(scene, "" if keeping is None else keeping.mark)
        if output is not None and copies is None:
            whole = report.joined(output.earlier, earlier.kept_sources)
            lightmap_versions.publish(output, _with_sidecar(whole, output, keeping))
        elif output is not None and copies is not None:
            undo.pop_all().close()  # the copy is to hold nothing of the earlier bake
            undo.enter_context(_restored_on_failure(context))
            remember_content(scene)
            yield Status("save", applying(copies)[1])
            with timed(seconds, "save"):
                save_copy(output)
            if copies.samples is not None:
                yield Status("preview", PREVIEW)
                with timed(seconds, "preview"):
                    render_preview(context, output.staging / PREVIEW_NAME, settings, copies.samples)
            report = _report(result, images, groups, settings, seconds)
            report = output.write_report(_with_sidecar(report, output, keeping))
            yield Status("write", 1.0)
            output.publish()
    if copies is None:
        # What was there before has gone by now. Objects that keep theirs may have been edited before.
        (forget_content if keeps_some else remember_content)(scene)
    if keeping is not None and kept is not None:
        kept_bakes.put(scene, keeping.mark, kept)
    kept_bakes.make_room()
    lightmap_versions.check()
    kept_details.keep(scene, result, [image.name for image in images])
    return report


@contextmanager
def _memory_put_back(scene: bpy.types.Scene) -> Iterator[None]:
    """Put back what the scene remembers of its earlier bake if this one fails."""
    groups = {name: getattr(scene, name) for name in _MEMORY if scene.is_property_set(name)}
    before = {
        (group, name): getattr(groups[group], name)
        for group in groups
        for name in _MEMORY[group]
        if groups[group].is_property_set(name)
    }
    try:
        yield
    except BaseException:
        for group, names in _MEMORY.items():
            for name in names if scene.is_property_set(group) else ():
                getattr(scene, group).property_unset(name)
        for (group, name), value in before.items():
            setattr(getattr(scene, group), name, value)
        raise


@contextmanager
def _restored_on_failure(context: bpy.types.Context) -> Iterator[None]:
    """Leave the originals, and no memory of a bake, if copies of it cannot be written."""
    try:
        yield
    except BaseException:
        restore(context)
        last_bake.forget(context.scene)
        kept_bakes.drop(context.scene)
        raise


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
        behind = (*behind, *show_look_of(context.scene))
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


def _with_sidecar(report: BakeReport, output: OutputFolder, keeping: KeepOptions | None) -> BakeReport:
    """Return the report with what proves that a sidecar, if the bake is kept in one, belongs to it."""
    if keeping is None or not keeping.sidecar:
        return report
    staged = output.staging / output.names.sidecar
    path = staged if staged.is_file() else output.path / output.names.sidecar
    return BakeReport({**report.data, KEPT: sidecar_entry(path, keeping.mark)})
