"""Open a scene file of any kind we know as Blender's current file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import addon_utils
import bpy

from ..errors import SceneError


def open_scene(path: str | Path) -> None:
    """Make the file at `path` the current one.

    A .blend is opened as it is. A .glb, .gltf or .obj is imported into an empty scene, as
    Blender's own File > Import would: glTF lamps are read in the standard's units (candela
    and lux, at 683 lm/W), OBJ files with Y up.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    SceneError
        If the file is missing, of another kind, or cannot be read.
    """
    path = Path(path).expanduser().absolute()
    opener = _OPENERS.get(path.suffix.lower())
    if opener is None:
        raise SceneError(f"{path} is not a scene we can open; give a {', '.join(_OPENERS)} file")
    if not path.exists():
        raise SceneError(f"{path} does not exist; check the path")
    if not path.is_file():
        raise SceneError(f"{path} is not a file; give a {', '.join(_OPENERS)} file")
    try:
        with path.open("rb") as stream:
            if not stream.read(1):
                raise SceneError(f"{path} is empty; save the scene again")
    except OSError as error:
        raise SceneError(f"{path} cannot be read: {error.strerror}") from None
    opener(path)


def empty_scene() -> None:
    """Replace the current file by one without any objects; preferences stay."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def _open_blend(path: Path) -> None:
    # load_ui: a saved window layout is of no use, and its areas cost time.
    _run(path, lambda: bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False))


def _import_gltf(path: Path) -> None:
    # Users may have switched the add-on off, and the bpy module may start without it.
    if addon_utils.check("io_scene_gltf2")[1] is False:
        addon_utils.enable("io_scene_gltf2", default_set=False)
    empty_scene()
    _run(path, lambda: bpy.ops.import_scene.gltf(filepath=str(path), export_import_convert_lighting_mode="SPEC"))


def _import_obj(path: Path) -> None:
    empty_scene()
    _run(path, lambda: bpy.ops.wm.obj_import(filepath=str(path)))


def _run(path: Path, operation: Callable[[], set[str]]) -> None:
    """Run an operator, its failure told in one line that names the file."""
    try:
        status = operation()
    except RuntimeError as error:
        raise SceneError(f"{path} cannot be read: {_one_line(str(error), path)}") from None
    except Exception as error:  # the importers let any exception of a broken file through
        raise SceneError(f"{path} cannot be read: {type(error).__name__}: {_one_line(str(error), path)}") from None
    if "FINISHED" not in status:
        raise SceneError(f"{path} cannot be read: Blender gave up on it; is the file complete?")


def _one_line(message: str, path: Path) -> str:
    """Keep the last line of an operator's message, without Blender's prefix and our path."""
    lines = [line.strip() for line in message.splitlines() if line.strip()]
    line = lines[-1] if lines else "unknown error"
    for noise in ("Error: ", f'Cannot read file "{path}": ', f"Cannot read file '{path}': "):
        line = line.removeprefix(noise)
    return line


_OPENERS: dict[str, Callable[[Path], None]] = {
    ".blend": _open_blend,
    ".glb": _import_gltf,
    ".gltf": _import_gltf,
    ".obj": _import_obj,
}
