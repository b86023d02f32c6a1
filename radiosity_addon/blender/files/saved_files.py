"""The .blend files that the command line writes: the baked scene, and a scene changed otherwise."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from ...base import BakeError
from ...files import BLEND_NAME
from ...publishing import replacing
from ..datablocks.bake_record import is_made
from .output import OutputFolder


def save_copy(output: OutputFolder) -> None:
    """Stage the open file as a compressed copy; the open file keeps its own path.

    Paths to images and other files are stored relative to where the copy will be, where
    they were relative to the open file; those of lightmaps always are.

    Raises BakeError if it cannot be written, or is the open file itself.
    """
    place = output.path / BLEND_NAME
    if bpy.data.filepath and Path(bpy.data.filepath).resolve() == place:
        raise BakeError(f"'{place}' is the scene itself: choose another folder for the copy")
    # Blender makes paths relative to the folder it saves into, so this must be the final one.
    try:
        with _lightmaps_relative_to(output.path):
            _save(output.aside, place)
        output.aside.replace(output.staging / BLEND_NAME)
    except OSError as error:
        raise BakeError(f"cannot write '{place}': {error.strerror}") from error


def save_scene(path: Path) -> None:
    """Save the open file as a compressed copy that replaces `path` once it is whole.

    Raises BakeError if it cannot be written.
    """
    try:
        with replacing(path) as aside:
            saved = aside.parent.with_name(f"{aside.parent.name}.blend")
            _save(saved, path)
            saved.replace(aside)
    except OSError as error:
        raise BakeError(f"cannot write '{path}': {error.strerror}") from error


def _save(aside: Path, place: Path) -> None:
    """Save a copy of the open file, to be moved to its place in the same folder."""
    try:
        bpy.ops.wm.save_as_mainfile(
            filepath=str(aside), copy=True, compress=True, relative_remap=True, check_existing=False
        )
    except RuntimeError as error:
        reason = " ".join(str(error).split()).replace(str(aside), str(place))
        raise BakeError(f"cannot write '{place}': {reason}") from error
    if not aside.is_file():
        raise BakeError(f"cannot write '{place}'")


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
