"""`bake --relight`: the bake in an output folder lit anew, by its sidecar and the lights of a scene."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

import bpy

from ..bake_scene import Progress
from ..console import Console, summary
from ..errors import UsageError
from ..interrupts import Interrupts
from ..keeping import Keeping
from ..relight_check import strengths_in
from ..report import BakeReport
from ..settings import BakeSettings
from ..sidecar import StoredBake, check_belongs, read_sidecar
from ..sidecar_names import SIDECAR_NAME
from ..solver.steps import drain
from .commands import check_writable, open_or_build, registered, same_file, written_files

EXPORT, RELIGHT, APPLY = 0.1, 0.2, 0.5
"""How far the whole is when each part begins; rough."""


def relight(
    scene: Path | None,
    loaded: Path | None,
    output: Path,
    settings: BakeSettings,
    report_copy: Path | None,
    console: Console,
    interrupts: Interrupts,
) -> None:
    """Light the bake in a folder anew, as the lights of the scene that was baked are now.

    Parameters
    ----------
    scene, loaded, report_copy, console, interrupts
        As for `commands.bake`.
    output : Path
        The folder with the bake and its sidecar.
    settings : BakeSettings
        As they were given; the bake has its own, and others than those are refused.

    Raises
    ------
    RadiosityError
        If the sidecar cannot be used, or the scene differs in more than strengths of its lights.
    """
    with registered():
        from .job import WRITING_STAGES
        from .output import BLEND_NAME, REPORT_NAME

        source = scene or loaded
        if source is not None and same_file(source, output / BLEND_NAME):
            raise UsageError(
                f"--relight takes the scene that was baked, not '{source}', which it would replace"
            )
        if report_copy is not None:
            check_writable(report_copy)
        console.progress("read", 0.0)
        stored = read_sidecar(output / SIDECAR_NAME, settings.memory_limit)
        check_belongs(stored, output / REPORT_NAME)
        given = replace(settings, memory_limit=None)
        if given not in (BakeSettings(), replace(stored.settings, memory_limit=None)):
            raise UsageError(f"the bake in {output} has its own settings: give --relight no others")
        open_or_build(scene, loaded)
        job = relight_into(bpy.context, stored, output)
        try:
            while True:
                try:
                    progress = next(job)
                except StopIteration as done:
                    report = done.value
                    break
                interrupts.check()
                interrupts.deferred = progress.stage in WRITING_STAGES
                console.progress(progress.stage, progress.fraction)
        finally:
            interrupts.deferred = True
            job.close()
        if report_copy is not None:
            report.write(report_copy)
        console.lines(summary(str(output), written_files(report.as_dict()), report.as_dict()))


def relight_into(
    context: bpy.types.Context, stored: StoredBake, folder: Path
) -> Generator[Progress, None, BakeReport]:
    """Light a stored bake anew, and write its folder as a bake would; the scene shows the lightmaps then.

    Raises
    ------
    RadiosityError
    """
    from .export import export_scene
    from .job import deliver, timed
    from .output import OutputFolder
    from .preview import QUICK_SAMPLES
    from .rebake import originals_shown
    from .relight import lit

    seconds: dict[str, float] = {}
    with OutputFolder(folder) as output:
        yield Progress("export", EXPORT)
        with timed(seconds, "export"), originals_shown(context):
            export = export_scene(context, stored.settings, dark=True)
        with timed(seconds, "relight"):
            kept = stored.kept(export.bake_scene)
            yield Progress("relight", RELIGHT)
            pages, groups = drain(lit(kept, strengths_in(kept, export.bake_scene)))
        result = replace(stored.result(export.bake_scene, pages), groups=groups)
        yield Progress("apply", APPLY)
        keeping = Keeping(sidecar=True, mark=stored.mark)
        made = export, result, output, seconds, keeping
        return (yield from deliver(context, stored.settings, *made, QUICK_SAMPLES))
