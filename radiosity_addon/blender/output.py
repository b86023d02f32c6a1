"""The output folder: files are written aside and renamed, so that a result is always whole."""

from __future__ import annotations

import os
import shutil
import tempfile
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

import bpy

from ..errors import BakeError
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
        self._staging: Path | None = None
        self._made: list[Path] = []

    @property
    def staging(self) -> Path:
        """Where to write, while the folder is open."""
        if self._staging is None:
            raise RuntimeError("the output folder is not open")
        return self._staging

    def __enter__(self) -> OutputFolder:
        """Make the folder and its staging folder; a BakeError names one that cannot be written."""
        missing = [folder for folder in (self.path, *self.path.parents) if not folder.exists()]
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._made = missing
            self._staging = Path(tempfile.mkdtemp(prefix=".radiosity-", dir=self.path))
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
        shutil.rmtree(self.staging, ignore_errors=True)
        self._staging = None
        self._remove_made()

    def publish(self) -> list[Path]:
        """Rename all staged files to their places; undone as a whole if one fails.

        Returns
        -------
        paths : list of Path
            The files as they are now, the report last.

        Raises
        ------
        BakeError
            If a file cannot be replaced.
        """
        names = [path.name for path in self.staging.iterdir() if path.is_file()]
        names.sort(key=lambda name: (name == REPORT_NAME, name))
        earlier = self.staging / "earlier"
        earlier.mkdir()
        done: list[str] = []
        try:
            for name in names:
                _keep(self.path / name, earlier / name)
                done.append(name)
                (self.staging / name).replace(self.path / name)
        except BaseException as error:
            self._take_back(done, earlier)
            if isinstance(error, OSError):
                raise BakeError(f"cannot replace '{self.path / name}': {error.strerror}") from error
            raise
        return [self.path / name for name in names]

    def _take_back(self, names: Sequence[str], earlier: Path) -> None:
        """Put the earlier files back where new ones have taken their places."""
        for name in names:
            if (earlier / name).exists():
                (earlier / name).replace(self.path / name)
            elif not (self.staging / name).exists():
                (self.path / name).unlink(missing_ok=True)

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


def _keep(path: Path, kept: Path) -> None:
    """Keep a file under a second name; nothing to do where there is none."""
    if path.is_dir():
        raise IsADirectoryError(21, "it is a folder")
    if not path.exists():
        return
    try:
        os.link(path, kept)
    except OSError:
        shutil.copy2(path, kept)
