"""What the command line's verbs do inside Blender."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import partial
from pathlib import Path

import bpy

from ...bake import Baking, KeepOptions
from ...bake.result import write_history
from ...base import BakeWarning, SceneError, UsageError
from ...cli import Console, FarmSpec, Interrupts, Permissions, run_through, summary
from ...farm import given_spool, own_spool, shared_bake, shared_pipeline, wanted_helpers
from ...files import BLEND_NAME, PREVIEW_NAME, REPORT_NAME, SIDECAR_NAME, Owner
from ...options import BakeSettings, Form
from ..apply.restore import restore_scene
from ..files.cornell import build_cornell_box
from ..files.files import empty_scene, open_scene
from ..files.output import OutputFolder
from ..files.ownership import CORNELL_BOX, owner_of
from ..files.saved_files import save_scene
from ..files.single_files import check_existing, check_places, make_folder_of, owner_record
from ..jobs.finish import WRITING_STAGES
from ..jobs.inspection import ERROR, inspect
from ..jobs.job import run_bake
from ..operators.checks import figures
from ..registration import register, unregister
from ..relight import kept_bakes
from ..session import last_bake
from .export_places import check_export

MAX_IMAGES = 8
"""The closing lines name at most this many lightmaps one by one."""


def bake(
    scene: Path | None,
    loaded: Path | None,
    output: Path,
    settings: BakeSettings,
    report_copy: Path | None,
    plot: Path | None,
    keeping: KeepOptions | None,
    allowed: Permissions,
    console: Console,
    interrupts: Interrupts,
    *,
    preview: bool,
    form: Form | None,
    baking: AbstractContextManager[Baking | None],
) -> None:
    """Bake a scene file, the file that is open, or the bundled Cornell box.

    Parameters
    ----------
    scene : Path or None
        The file to open; None for `loaded`, or else the Cornell box.
    loaded : Path or None
        The file the host has open.
    output : Path
        Folder for everything.
    settings : BakeSettings
    report_copy : Path or None
        Second copy of the report.
    plot : Path or None
        Where the history is drawn to.
    keeping : KeepOptions or None
        How the bake is kept, to be relit.
    allowed : Permissions
    console : Console
    interrupts : Interrupts
    preview : bool
        Whether a picture of the result is rendered.
    form : Form or None
        What is exported afterwards: its files are checked before the bake starts.
    baking : context manager of Baking or None
        Entered when the bake begins: what takes the pipeline's place, see `run_bake`.
    """
    with registered(), ExitStack() as stack:
        source = scene or loaded
        if source is not None and same_file(source, output / BLEND_NAME):
            raise UsageError(f"--output {output} would overwrite the scene '{source}'; choose another folder")
        check_places(_places(report_copy, plot), source)
        console.progress("open", 0.0)
        notes = open_or_build(scene, loaded, allowed)
        folder = output_of(output, source, allowed, report_copy, plot)
        if form is not None:
            check_export(output, form, settings.quantity, allowed)
        job = run_bake(
            bpy.context,
            settings,
            folder,
            with_copy=True,
            keeping=keeping,
            notes=notes,
            with_preview=preview,
            baking=stack.enter_context(baking),
        )
        report = run_through(job, console, interrupts, WRITING_STAGES)
        if report_copy is not None:
            report.write_copy(report_copy)
        files = written_files(report.as_dict(), preview, keeping is not None)
        if plot is not None:
            console.progress("plot", 1.0)
            write_history(report.as_dict(), plot.resolve())
            files.append((str(plot), "history of the solution"))
        console.lines(summary(str(output), files, report.as_dict()))


@contextmanager
def shared_with(output: Path, spool: Path | None, farm: FarmSpec | None) -> Iterator[Baking | None]:
    """Yield the pipeline shared through a spool if one is given or workers are, else None."""
    if spool is None and farm is None:
        yield None
        return
    folder = own_spool(output) if spool is None else given_spool(spool)
    with wanted_helpers(farm) as helpers, folder as shared:
        yield shared_pipeline(partial(shared_bake, shared, helpers))


def _places(report_copy: Path | None, plot: Path | None) -> dict[str, Path]:
    """Return the files to be written outside the bake's own, by option."""
    given = {"--report": report_copy, "--plot": plot}
    return {option: path for option, path in given.items() if path is not None}


def command_owner(source: Path | None) -> Owner:
    """Return who a bake of the open scene belongs to, which came from a file or is the bundled one."""
    came_from = CORNELL_BOX if source is None else str(source.expanduser().resolve())
    return owner_of(bpy.context.scene, came_from)


def output_of(
    output: Path,
    source: Path | None,
    allowed: Permissions,
    report_copy: Path | None = None,
    plot: Path | None = None,
) -> OutputFolder:
    """Return the folder of a bake of the open scene, and see that the files next to it may be written.

    Raises
    ------
    BakeError
    """
    owner = command_owner(source)
    if report_copy is not None:
        check_existing("--report", report_copy, allowed.overwrite, owner_record(owner, output))
    if plot is not None:
        check_existing("--plot", plot, allowed.overwrite)
    others = _places(report_copy, plot).values()
    return OutputFolder(output, overwrite=allowed.overwrite, others=list(others), owner=owner)


def check(
    scene: Path | None,
    loaded: Path | None,
    output: Path | None,
    settings: BakeSettings,
    allowed: Permissions,
    console: Console,
) -> int:
    """Say what a bake would be and what is odd, without baking; 1 where it would stop, 0 otherwise.

    Parameters
    ----------
    scene, loaded : Path or None
        As for `bake`.
    output : Path or None
        Where the bake would write.
    """
    with registered():
        console.progress("open", 0.0)
        open_or_build(scene, loaded, allowed)
        folder = output.expanduser().resolve() if output is not None else Path.cwd()
        into = None if output is None else output_of(output, scene or loaded, allowed)
        found = inspect(bpy.context, settings, folder, into, (BLEND_NAME, PREVIEW_NAME))
        lines = [f"  {name:<12} {value}" for name, value in figures(found)]
        odd = [f"  {finding.level.lower():<8} {finding.message}" for finding in found.findings]
        console.lines(
            ["estimate of the bake:", *lines, *(["problems:", *odd] if odd else ["no problems found"])]
        )
        wrong = [finding.message for finding in found.findings if finding.level == ERROR]
        if wrong and console.quiet:
            raise SceneError(wrong[0])
        return int(bool(wrong))


def restore(
    scene: Path | None, loaded: Path | None, output: Path, allowed: Permissions, console: Console
) -> None:
    """Take the bake out of a file and write the result to another.

    Raises
    ------
    RadiosityError
        If the file shows no bake, or the other may not be written.
    """
    with registered():
        if scene is None and loaded is None:
            raise UsageError("restore needs SCENE, a baked .blend")
        check_places({"--output": output}, scene or loaded)
        if scene is not None:
            open_scene(scene, allowed.scripts)
        check_existing("--output", output, allowed.overwrite)
        restored = restore_scene(bpy.context, None)
        count = restored.count
        if not count:
            raise SceneError(f"'{scene or loaded}' shows no bake; there is nothing to restore")
        for each in bpy.data.scenes:
            last_bake.forget(each)
            kept_bakes.drop(each)
        make_folder_of(output)
        save_scene(output)
        lines = [f"{count} object{'' if count == 1 else 's'} restored, written to {output}"]
        console.lines([*lines, *(f"warning: {warning.message}" for warning in restored.warnings)])


def open_or_build(scene: Path | None, loaded: Path | None, allowed: Permissions) -> tuple[BakeWarning, ...]:
    """Have the scene to bake as the open file's scene; returns what to warn of."""
    if scene is not None:
        return open_scene(scene, allowed.scripts)
    if loaded is None:
        empty_scene()
        build_cornell_box()
    return ()


def written_files(report: dict, preview: bool = True, kept: bool = False) -> list[tuple[str, str]]:
    """What a bake, with a preview or a sidecar or without, has left in its folder, for people to read."""
    images = list(dict.fromkeys(entry["image"] for entry in report["objects"]))
    shown = images if len(images) <= MAX_IMAGES else [f"{images[0]} … {images[-1]}"]
    return [
        (BLEND_NAME, "the scene with its lightmaps"),
        *_group_files(report),
        *(
            (image, "lightmap" if len(shown) == len(images) else f"{len(images)} lightmaps")
            for image in shown
        ),
        *([(PREVIEW_NAME, "preview")] if preview else []),
        *([(SIDECAR_NAME, "data for --relight")] if kept else []),
        (REPORT_NAME, "objects, figures and warnings"),
    ]


def _group_files(report: dict) -> list[tuple[str, str]]:
    """What there is of each light group."""
    files = []
    for group in report.get("light_groups", ()):
        names = [page["image"] for page in group["pages"]]
        shown = names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"
        files.append((shown, f"light of group '{group['group']}'"))
    return files


def same_file(one: Path, other: Path) -> bool:
    """Whether both name one existing file."""
    try:
        return one.samefile(other)
    except OSError:
        return False


@contextmanager
def registered() -> Iterator[None]:
    """Register the extension for a command, unless the host has done so already."""
    if hasattr(bpy.types.Scene, "radiosity"):
        yield
        return
    register()
    try:
        yield
    finally:
        unregister()
