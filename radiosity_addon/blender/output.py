"""The output folder: files are written aside and renamed, so that a result is always whole."""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

import bpy

from .. import manifest
from ..errors import BakeError
from ..staging import Staging, clean_up
from .bake_record import is_made

BLEND_NAME = "baked.blend"
PREVIEW_NAME = "preview.png"
REPORT_NAME = "report.json"

FILES = (
    (BLEND_NAME, "the scene with its lightmaps"),
    ("*.exr or *.png", "the lightmaps"),
    (PREVIEW_NAME, "what it looks like"),
    (REPORT_NAME, "objects, figures and warnings"),
)
"""What a finished bake leaves in the folder, for people to read."""


class OutputFolder:
    """A folder that gets all of a bake's files at once, or none.

    A context manager. Inside it, write into `staging`, a hidden folder on the same file
    system laid out as the result will be; `publish` then renames file by file over an
    earlier result, the report last. Leaving without it, or by an error, leaves the folder
    as it was. Files that the bake did not write are never touched.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path).expanduser().resolve()
        self._staging: Staging | None = None
        self._made: list[Path] = []

    @property
    def staging(self) -> Path:
        """Where to write, while the folder is open."""
        return self._open.path

    @property
    def _open(self) -> Staging:
        if self._staging is None:
            raise RuntimeError("the output folder is not open")
        return self._staging

    def __enter__(self) -> OutputFolder:
        """Make the folder and its staging folder; a BakeError names one that cannot be written.

        What a killed bake has left there is cleaned up first.
        """
        missing = [folder for folder in (self.path, *self.path.parents) if not folder.exists()]
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._made = missing
            clean_up(self.path)
            self._staging = Staging(self.path)
        except OSError as error:
            self._remove_made()
            raise BakeError(
                f"cannot write to the output folder '{self.path}': {error.strerror}; choose another"
            ) from error
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        """Remove what was not published, and folders that were made for nothing."""
        self._open.close()
        self._staging = None
        self._remove_made()

    def files(self) -> dict[str, dict[str, Any]]:
        """Return what the report is to list of the files here: those staged, and those of earlier bakes."""
        staged = [self.staging / name for name in self._open.names() if name != REPORT_NAME]
        return manifest.entries(staged, self.path / REPORT_NAME, bpy.data.filepath)

    def publish(self) -> list[Path]:
        """Rename all staged files to their places; undone as a whole if one fails.

        Killed meanwhile, the next bake into the folder, or opening the file, puts the earlier ones back.

        Returns
        -------
        paths : list of Path
            The files as they are now, the report last.

        Raises
        ------
        BakeError
            If a file cannot be replaced.
        """
        names = sorted(self._open.names(), key=lambda name: (name == REPORT_NAME, name))
        try:
            self._open.publish(names)
        except OSError as error:
            raise BakeError(f"cannot replace '{error.filename}': {error.strerror}") from error
        return [self.path / name for name in names]

    def _remove_made(self) -> None:
        """Remove the folders made on entering that are still empty, innermost first."""
        for folder in self._made:
            try:
                folder.rmdir()
            except OSError:
                return


def save_copy(path: Path, final_folder: Path | None = None) -> None:
    """Save the open file as a compressed copy; the open file keeps its own path.

    Paths to images and other files are stored relative to where the copy will be, where
    they were relative to the open file; those of lightmaps always are.

    Parameters
    ----------
    path : Path
        The copy; replaced only once it is written.
    final_folder : Path or None
        The folder the copy will be moved to, on the same file system; None if it stays.

    Raises
    ------
    BakeError
        If it cannot be written, or is the open file itself.
    """
    path = path.resolve()
    folder = path.parent if final_folder is None else final_folder.resolve()
    if bpy.data.filepath and Path(bpy.data.filepath).resolve() in (path, folder / path.name):
        raise BakeError(f"'{folder / path.name}' is the scene itself: choose another folder for the copy")
    # Blender makes paths relative to the folder it saves into, so this must be the final one.
    aside = folder / f".{path.stem}-{uuid.uuid4().hex[:8]}.blend"
    try:
        with _lightmaps_relative_to(folder):
            bpy.ops.wm.save_as_mainfile(
                filepath=str(aside), copy=True, compress=True, relative_remap=True, check_existing=False
            )
        aside.replace(path)
    except (OSError, RuntimeError) as error:
        reason = error.strerror if isinstance(error, OSError) else " ".join(str(error).split())
        raise BakeError(f"cannot write '{folder / path.name}': {reason}") from error
    finally:
        aside.unlink(missing_ok=True)


@contextmanager
def _lightmaps_relative_to(folder: Path) -> Iterator[None]:
    """Have the lightmaps' paths come out relative to `folder` in a copy that is saved there.

    Blender remaps relative paths itself, from the open file's folder to the copy's. A file
    that was never saved has no folder: what is relative in it is stored as it stands.
    """
    lightmaps = [image for image in bpy.data.images if is_made(image) and image.filepath_raw]
    before = [(image, image.filepath_raw) for image in lightmaps]
    try:
        for image, stored in before:
            if not bpy.data.filepath and Path(stored).parent == folder:
                image.filepath_raw = f"//{Path(stored).name}"
        yield
    finally:
        for image, stored in before:
            image.filepath_raw = stored
