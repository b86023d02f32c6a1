"""`bake --relight`: relight the bake in an output folder by its sidecar and the lights of a scene."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import bpy

from ...bake import BakeDigests, KeepOptions, timed
from ...bake.relight import estimated_errors, noise_warnings, strengths_in
from ...bake.result import BakeReport
from ...bake.sidecar import StoredBake, check_belongs, read_sidecar
from ...base import BakeError, BakeWarning, Status, UsageError, staged
from ...cli import Console, Interrupts, Permissions, run_through, summary
from ...files import (
    BLEND_NAME,
    OWNER,
    PREVIEW_NAME,
    REPORT_NAME,
    SIDECAR_NAME,
    NoReportError,
    read_report,
)
from ...options import OPTIONS, BakeSettings, Form
from ..apply.rebake import Originals
from ..files.output import OutputFolder
from ..files.single_files import check_places
from ..images.images import group_file_names, page_file_names
from ..jobs.finish import WRITING_STAGES, Copies, finish
from ..jobs.preview import QUICK_SAMPLES
from ..relight.relight_scene import lit
from ..scene_export.export import export_steps
from .export_places import check_export
from .verbs import command_owner, open_or_build, output_of, registered, same_file, written_files

EXPORT, RELIGHT, APPLY = 0.1, 0.2, 0.5
"""How far the whole is when each part begins; rough."""


def relight(
    scene: Path | None,
    loaded: Path | None,
    output: Path,
    settings: BakeSettings,
    given: Sequence[str],
    report_copy: Path | None,
    allowed: Permissions,
    console: Console,
    interrupts: Interrupts,
    *,
    preview: bool = True,
    form: Form | None = None,
) -> None:
    """Relight the bake in a folder with the present lights of the scene that was baked.

    Parameters
    ----------
    scene, loaded, report_copy, allowed, console, interrupts, preview, form
        As for `verbs.bake`.
    output : Path
        The folder with the bake and its sidecar.
    settings : BakeSettings
        The bake has its own: …
    given : sequence of str
        … those of these names that are others are refused.

    Raises
    ------
    RadiosityError
        If the sidecar cannot be used, or the scene differs in more than strengths of its lights.
    """
    with registered():
        source = scene or loaded
        if source is not None and same_file(source, output / BLEND_NAME):
            raise UsageError(
                f"--relight takes the scene that was baked, not '{source}', which it would replace"
            )
        check_places({} if report_copy is None else {"--report": report_copy}, source)
        console.progress("read", 0.0)
        stored = read_sidecar(output / SIDECAR_NAME, settings.memory_limit)
        check_belongs(stored, output / REPORT_NAME)
        other = _other_flags(settings, given, stored.settings)
        if other:
            raise UsageError(
                f"--relight uses the settings of the bake in {output}, which differ in {', '.join(other)}: "
                "leave these out, or bake again"
            )
        notes = open_or_build(scene, loaded, allowed)
        if not allowed.overwrite:
            _check_same_scene(output, source)
        folder = output_of(output, source, allowed, report_copy)
        if form is not None:
            check_export(output, form, stored.settings.quantity, allowed)
        job = relight_into(bpy.context, stored, folder, notes, preview)
        report = run_through(job, console, interrupts, WRITING_STAGES)
        if report_copy is not None:
            report.write_copy(report_copy)
        files = written_files(report.as_dict(), preview)
        console.lines(summary(str(output), files, report.as_dict()))


def _check_same_scene(output: Path, source: Path | None) -> None:
    """Refuse the bake of another file, or scene, than the open one: also of a copy under another name.

    Raises
    ------
    BakeError
    """
    owner = command_owner(source)
    with suppress(FileNotFoundError, NoReportError):  # refused later, as what stands in the way of any bake
        report = read_report(output / REPORT_NAME)
        if not owner.owns(report, output):
            said = report[OWNER]
            raise BakeError(
                f"'{output / REPORT_NAME}' is of scene '{said['scene']}' of '{said['file']}', but --relight "
                f"got scene '{owner.scene}' of '{owner.source}': give the file that was baked, bake this one "
                "into another folder, or give --overwrite if it is the same file, renamed"
            )


def _other_flags(settings: BakeSettings, given: Sequence[str], of_bake: BakeSettings) -> list[str]:
    """Return the flags that were given with other values than those of a bake; memory is this run's own."""
    return [
        OPTIONS[name].flag
        for name in given
        if name != "memory_limit" and getattr(settings, name) != getattr(of_bake, name)
    ]


def relight_into(
    context: bpy.types.Context,
    stored: StoredBake,
    folder: OutputFolder,
    notes: tuple[BakeWarning, ...] = (),
    preview: bool = True,
) -> Generator[Status, None, BakeReport]:
    """Relight a stored bake, and write its folder as a bake would; the scene shows the lightmaps then.

    Raises
    ------
    RadiosityError
    """
    seconds: dict[str, float] = {}
    with folder as output:
        output.expect((BLEND_NAME, PREVIEW_NAME, output.names.sidecar))
        yield Status("export", EXPORT)
        with timed(seconds, "export"):
            shown = Originals(context)
            steps = export_steps(context, stored.settings, dark=True, shown=shown)
            export = yield from staged(steps, "export", EXPORT, EXPORT)
        with timed(seconds, "relight"):
            kept = stored.kept(export.bake_scene)
            yield Status("relight", RELIGHT)
            strengths = strengths_in(kept, export.bake_scene)
            pages, groups = lit(kept, strengths)
            before, now = estimated_errors(kept, strengths)
        result = stored.result(export.bake_scene, pages, now)
        warnings = (*notes, *result.warnings, *noise_warnings(before, now))
        result = replace(result, groups=groups, warnings=warnings)
        output.expect(page_file_names(result, stored.settings))
        output.expect(name for of in group_file_names(result, stored.settings) for name in of)
        yield Status("apply", APPLY)
        keeping = KeepOptions(sidecar=True, mark=stored.bake_id)
        finished = finish(
            context,
            stored.settings,
            export,
            result,
            output,
            digests=BakeDigests.of(export.bake_scene, stored.settings),
            seconds=seconds,
            keeping=keeping,
            copies=Copies(QUICK_SAMPLES if preview else None),
        )
        return (yield from finished)
