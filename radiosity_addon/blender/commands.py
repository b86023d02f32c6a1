"""What the command line's verbs do inside Blender."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from .. import register, unregister
from ..console import Console, summary
from ..errors import BakeError, SceneError, UsageError
from ..interrupts import Interrupts
from ..keeping import Keeping
from ..settings import BakeSettings
from . import kept_bakes, runtime

MAX_IMAGES = 8
"""The closing lines name so many lightmaps one by one."""


def bake(
    scene: Path | None,
    loaded: Path | None,
    output: Path,
    settings: BakeSettings,
    report_copy: Path | None,
    plot: Path | None,
    keep: bool,
    console: Console,
    interrupts: Interrupts,
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
    keep : bool
        Whether a sidecar is written, by which the bake can be lit anew.
    console : Console
    interrupts : Interrupts
    """
    with registered():
        from .job import WRITING_STAGES, run_bake
        from .output import BLEND_NAME, OutputFolder

        source = scene or loaded
        if source is not None and same_file(source, output / BLEND_NAME):
            raise UsageError(f"--output {output} would overwrite the scene '{source}'; choose another folder")
        for path in filter(None, (report_copy, plot)):
            # Now, not after all the work.
            check_writable(path)
        console.progress("open", 0.0)
        open_or_build(scene, loaded)
        keeping = Keeping(sidecar=True) if keep else None
        job = run_bake(bpy.context, settings, OutputFolder(output), with_copy=True, keeping=keeping)
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
        files = written_files(report.as_dict())
        if plot is not None:
            from .plot import render_plot

            console.progress("plot", 1.0)
            render_plot(report.as_dict(), plot.resolve())
            files.append((str(plot), "how it was solved"))
        console.lines(summary(str(output), files, report.as_dict()))


def check(
    scene: Path | None, loaded: Path | None, output: Path | None, settings: BakeSettings, console: Console
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
        from .check_panel import figures
        from .inspection import ERROR, inspect

        console.progress("open", 0.0)
        open_or_build(scene, loaded)
        folder = output.expanduser().resolve() if output is not None else Path.cwd()
        found = inspect(bpy.context, settings, folder)
        lines = [f"  {name:<12} {value}" for name, value in figures(found)]
        odd = [f"  {finding.level.lower():<8} {finding.message}" for finding in found.findings]
        console.lines(["a bake would be:", *lines, *(["what is odd:", *odd] if odd else ["nothing is odd"])])
        return int(any(finding.level == ERROR for finding in found.findings))


def restore(scene: Path | None, loaded: Path | None, output: Path, console: Console) -> None:
    """Take the bake out of a file and write the result to another.

    Raises
    ------
    SceneError
        If the file shows no bake.
    """
    with registered():
        from .files import open_scene
        from .output import save_copy
        from .restore import restore_scene

        if scene is not None:
            open_scene(scene)
        elif loaded is None:
            raise UsageError("restore needs SCENE, a baked .blend")
        restored = restore_scene(bpy.context, None)
        count = restored.count
        if not count:
            raise SceneError(f"'{scene or loaded}' shows no bake; there is nothing to restore")
        for each in bpy.data.scenes:
            runtime.forget(each)
            kept_bakes.drop(each)
        _make_folder_of(output)
        save_copy(output)
        lines = [f"{count} object{'' if count == 1 else 's'} restored, written to {output}"]
        console.lines([*lines, *(f"warning: {warning.message}" for warning in restored.warnings)])


def open_or_build(scene: Path | None, loaded: Path | None) -> None:
    """Have the scene to bake as the open file's scene."""
    from .cornell import build_cornell_box
    from .files import empty_scene, open_scene

    if scene is not None:
        open_scene(scene)
    elif loaded is None:
        empty_scene()
        build_cornell_box()


def written_files(report: dict) -> list[tuple[str, str]]:
    """What a bake has left in its folder, for people to read."""
    from .output import BLEND_NAME, PREVIEW_NAME, REPORT_NAME

    images = list(dict.fromkeys(entry["image"] for entry in report["objects"]))
    shown = images if len(images) <= MAX_IMAGES else [f"{images[0]} … {images[-1]}"]
    return [
        (BLEND_NAME, "the scene with its lightmaps"),
        *_group_files(report),
        *(
            (image, "lightmap" if len(shown) == len(images) else f"{len(images)} lightmaps")
            for image in shown
        ),
        (PREVIEW_NAME, "what it looks like"),
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


def _make_folder_of(path: Path) -> None:
    """Make the folder of a file to be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BakeError(f"cannot write '{path}': its folder cannot be made ({error.strerror})") from error


def check_writable(path: Path) -> None:
    """Make the folder of a file to be written later, and see that files can be written there.

    Raises
    ------
    BakeError
        If not.
    """
    _make_folder_of(path)
    if path.is_dir():
        raise BakeError(f"cannot write '{path}': it is a folder")
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        aside.touch()
        aside.unlink()
    except OSError as error:
        raise BakeError(f"cannot write '{path}': {error.strerror}") from error


def same_file(one: Path, other: Path) -> bool:
    """Whether both name one existing file."""
    return one.exists() and other.exists() and one.samefile(other)


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
