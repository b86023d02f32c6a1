"""Which version of its file a lightmap image shows, and bringing versions back after undo and redo.

Undo takes UV maps and image datablocks back, but no files and no pixels. So each image says which bytes its
file has to have, by their digest, and that is saved and undone with it; the report next to the file says
which bytes it has. Where the two differ after undo or redo, the file is put back as it was from those that
are held (`file_versions.py`), published as any other, and the image loaded again.

The handlers only compare. Files are copied in a thread, and a timer does what must be done with Blender;
without a window, where no timer fires, all is done at once.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy

from ...base import BakeError, RadiosityError
from ...files import KEPT, LISTED, REPORT_NAME, digest_of_file, images_described
from ..datablocks.bake_record import is_made
from ..datablocks.image_marks import PAGE, REPORT, VERSION
from ..files.lightmap_reports import forget_reports, listed_in, report_of
from ..files.ownership import own_reports
from ..session.redraw import redraw_sidebars, redraw_viewports
from ..session.state import session
from .file_versions import MOST_FILES, HeldFiles

if TYPE_CHECKING:
    from ...bake.result import BakeReport
    from ..files.output import OutputFolder

TICK = 0.02
"""Seconds between two looks at whether files have been copied."""

FOREIGN = "The lightmaps on disk are from another bake than this file: bake again"


class WantedFile(NamedTuple):
    """An image whose file has other bytes than it should.

    Attributes
    ----------
    image : str
        Its name: references die at undo.
    path : Path
        Of the file.
    version : str
        The digest of the bytes that it should have.
    report : Path
        That lists it.
    """

    image: str
    path: Path
    version: str
    report: Path


state = session.versions


def mark(images: Iterable[bpy.types.Image], report: str = REPORT_NAME) -> None:
    """Note on images, just saved or packed, which version of their file they show, and the report with it."""
    for image in images:
        image[REPORT] = report
        if image.packed_file is not None:
            image[VERSION] = hashlib.sha256(image.packed_file.data).hexdigest()
        else:
            image[VERSION] = digest_of_file(Path(bpy.path.abspath(image.filepath_raw)))
        state.shown[image.name] = image[VERSION]


def unsettle(images: Iterable[bpy.types.Image]) -> None:
    """Note that images show pixels that no file has."""
    for image in images:
        state.shown[image.name] = ""


def _open(report: Path) -> OutputFolder:
    """Open the folder of a report of this file for files that it lists."""
    from ..files.output import OutputFolder

    for scene in bpy.data.scenes:
        for own in own_reports(report.parent, scene):
            if own.names.report == report.name:
                return OutputFolder(report.parent, own.names, owner=own.owner).__enter__()
    raise BakeError(f"'{report}' is not a report of this file")


def publish(output: OutputFolder, report: BakeReport) -> None:
    """Publish a folder's staged files with their report; what they replace is held for undo."""
    output.write_report(report)
    _hold(output)
    output.publish()


def _hold(output: OutputFolder) -> None:
    """Hold what is about to be replaced in a folder, with what its report says of it."""
    report = output.earlier
    if report is None:
        return
    listed = report[LISTED]
    names = {path.name for path in output.staging.iterdir() if path.is_file()}
    if state.held is None:
        state.held = HeldFiles(Path(bpy.app.tempdir))
    for name in sorted(names & listed.keys()):
        # What relighting needs is large, and in memory as well.
        if name != output.names.sidecar:
            state.held.hold(output.path / name, str(listed[name]["sha256"]))
    for name in images_described(report) & listed.keys():
        state.reports[str(listed[name]["sha256"])] = report
        state.reports.move_to_end(str(listed[name]["sha256"]))
    while len(state.reports) > MOST_FILES:
        state.reports.popitem(last=False)


def lightmaps() -> list[bpy.types.Image]:
    """Return the lightmap images of the open file that say which version they show."""
    own = [image for image in bpy.data.images if image.library is None and is_made(image)]
    return [image for image in own if PAGE in image.keys() and image.get(VERSION)]  # noqa: SIM118 (an ID)


def differing() -> list[WantedFile]:
    """Return the images whose files have, by the reports next to them, other bytes than they should."""
    found = []
    for image in lightmaps():
        if image.packed_file is not None:
            continue
        path, report = Path(bpy.path.abspath(image.filepath_raw)), report_of(image)
        listed = listed_in(report).get(path.name)
        if listed is not None and listed["sha256"] != image[VERSION]:
            found.append(WantedFile(image.name, path, image[VERSION], report))
    return found


def flush() -> None:
    """Finish at once what is left to be brought back."""
    if state.swap is not None:
        state.swap.thread.join()
        _finish()


def follow_undo(*_: Any) -> None:
    """Undo and redo bring images back, but neither pixels nor files."""
    state.message = ""
    follow()


def follow() -> None:
    """Begin to bring back what undo or redo wants to see: other files, other pixels."""
    stale = any(_is_stale(image) for image in lightmaps())
    wanted = differing()
    if not (wanted or stale or state.swap is not None or state.message):
        return
    if bpy.app.background:
        _cancel()
        _reload_stale()
        _begin(wanted)
        flush()
    elif not is_at_work():
        bpy.app.timers.register(_tick, first_interval=0.0, persistent=True)


def check(*_: Any) -> None:
    """Say so where the open file shows other bakes than are on the disk; touches nothing."""
    state.message = FOREIGN if differing() else ""


class _Swap:
    """Files on their way back."""

    def __init__(self, wanted: Sequence[WantedFile]) -> None:
        self.wanted = tuple(wanted)
        self.outputs: dict[Path, OutputFolder] = {}
        self.error = ""
        try:
            for one in wanted:
                if one.report not in self.outputs:
                    self.outputs[one.report] = _open(one.report)
        except BaseException:
            self.close()
            raise
        self.thread = threading.Thread(target=self._copy, name="radiosity versions", daemon=True)
        self.thread.start()

    def _copy(self) -> None:
        """Copy what is held next to its place; in the thread, which knows nothing of Blender."""
        assert state.held is not None
        try:
            for one in self.wanted:
                state.held.copy_to(one.version, self.outputs[one.report].staging / one.path.name)
        except RadiosityError as error:
            self.error = str(error)

    def publish(self) -> None:
        """Put the files in their places, with the reports that they had."""
        for report, output in self.outputs.items():
            publish(output, _report_with(output, [one for one in self.wanted if one.report == report]))

    def close(self) -> None:
        """Remove what was not published."""
        for output in self.outputs.values():
            output.__exit__(None, None, None)
        self.outputs = {}


def _begin(wanted: Sequence[WantedFile]) -> None:
    """Begin to bring files back, those that are held; say so of the others."""
    held = state.held
    there = [one for one in wanted if held is not None and one.version in held]
    state.message = FOREIGN if len(there) < len(wanted) else ""
    if not there:
        return
    try:
        state.swap = _Swap(there)
    except RadiosityError as error:
        state.message = f"{FOREIGN} ({error})"


def _finish() -> None:
    """Publish what was copied, and show it."""
    swap, state.swap = state.swap, None
    assert swap is not None
    try:
        if swap.error:
            raise BakeError(swap.error)
        if set(swap.wanted) <= set(differing()):
            swap.publish()
            for one in swap.wanted:
                _reload(bpy.data.images[one.image])
    except RadiosityError as error:
        state.message = f"{FOREIGN} ({error})"
    finally:
        swap.close()


def _cancel() -> None:
    """Give up what is on its way."""
    swap, state.swap = state.swap, None
    if swap is not None:
        swap.thread.join()
        swap.close()


def _report_with(output: OutputFolder, wanted: Sequence[WantedFile]) -> BakeReport:
    """Return the report that the files had, with all that lies in the folder now."""
    from ...bake.result import BakeReport

    current = output.earlier or {}
    stored = next((state.reports[one.version] for one in wanted if one.version in state.reports), current)
    before, listed = (report.get(LISTED, {}) for report in (stored, current))
    if before.get(output.names.sidecar) != listed.get(output.names.sidecar):
        # Its sidecar is not there any more.
        stored = {key: value for key, value in stored.items() if key != KEPT}
    return BakeReport(dict(stored))


def _is_stale(image: bpy.types.Image) -> bool:
    return state.shown.get(image.name, image[VERSION]) != image[VERSION]


def _reload_stale() -> None:
    """Load the images again whose pixels in memory are of another version than their files."""
    waiting = {one.image for one in differing()}
    for image in lightmaps():
        if _is_stale(image) and image.name not in waiting:
            _reload(image)


def _reload(image: bpy.types.Image) -> None:
    image.reload()
    image.update_tag()
    state.shown[image.name] = image[VERSION]
    session.lightmaps_changed()
    with suppress(RadiosityError):
        if session.live is not None:
            session.live.look_again()


def is_at_work() -> bool:
    """Return whether files or images are still being changed after an undo or redo."""
    return bpy.app.timers.is_registered(_tick)


def _tick() -> float | None:
    """Carry on with what undo began; nothing may be raised."""
    try:
        if state.swap is not None and state.swap.thread.is_alive():
            return TICK
        if state.swap is not None:
            _finish()
        _reload_stale()
        wanted = differing()
        if wanted and not state.message:
            _begin(wanted)
        elif not wanted:
            state.message = ""
        if state.swap is not None:
            return TICK
        redraw_viewports()
        redraw_sidebars()
        return None
    except Exception as error:  # noqa: BLE001 (a timer that raises is gone)
        state.message = f"{FOREIGN} ({type(error).__name__}: {error})"
        return None


def before_saving(*_: Any) -> None:
    """What is saved must agree with the files next to it."""
    if state.swap is None and not bpy.app.background and differing():
        _begin(differing())
    flush()


def forget(*_: Any) -> None:
    """Hold nothing any more: another file is being opened, or the extension is switched off."""
    if is_at_work():
        bpy.app.timers.unregister(_tick)
    _cancel()
    if state.held is not None:
        state.held.close()
    state.held, state.message = None, ""
    state.reports.clear()
    state.shown.clear()
    forget_reports()
