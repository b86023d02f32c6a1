"""Open a scene file of any kind we know as Blender's current file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import addon_utils  # type: ignore[import-not-found]
import bpy

from ...base import BakeWarning, SceneError
from ..datablocks.quiet_output import silenced
from .gltf_check import gltf_fault
from .imported_lightmaps import as_they_are
from .scene_parts import scene_parts


def open_scene(path: str | Path, scripts: bool = False) -> tuple[BakeWarning, ...]:
    """Make the file at `path` the current one.

    A .blend is opened as it is. A .glb, .gltf or .obj is imported into an empty scene, as
    Blender's own File > Import would: glTF lamps are read in the standard's units (candela
    and lux, at 683 lm/W), OBJ files with Y up.

    Parameters
    ----------
    path : str or Path
    scripts : bool
        Whether scripts and script expressions of a .blend are run: only of one that is trusted.

    Returns
    -------
    warnings : tuple of BakeWarning
        That scripts were not run, if there are any.

    Raises
    ------
    SceneError
        If the file is missing, of another kind, or cannot be read.
    """
    path = Path(path).expanduser().absolute()
    opener = _OPENERS.get(path.suffix.lower())
    if opener is None:
        raise SceneError(f"{path} is not a supported scene; use a {', '.join(_OPENERS)} file")
    try:
        if not path.exists():
            raise SceneError(f"{path} does not exist; check the path")
        if not path.is_file():
            raise SceneError(f"{path} is not a file; give a {', '.join(_OPENERS)} file")
        with path.open("rb") as stream:
            if not stream.read(1):
                raise SceneError(f"{path} is empty; save the scene again")
    except OSError as error:
        raise SceneError(f"{path} cannot be read: {error.strerror}") from None
    if opener is _open_blend:
        _open_blend(path, scripts)
        return _blocked_scripts()
    for part in scene_parts(path):
        if part.exists() and not part.is_file():  # an importer would read a device without end
            raise SceneError(
                f"{path} cannot be read: its part '{part}' is not a file; export the scene again"
            )
    opener(path)
    return ()


def empty_scene() -> None:
    """Replace the current file by one without any objects; preferences stay."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def _open_blend(path: Path, scripts: bool = False) -> None:
    # load_ui: a saved window layout is of no use, and its areas cost time.
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=scripts)
    except RuntimeError:
        # What Blender says is no help: a newer file is "not a blend file" to it.
        raise SceneError(
            f"{path} cannot be read by Blender {bpy.app.version_string}: "
            "it is damaged, not a .blend, or saved by a newer version"
        ) from None


def _blocked_scripts() -> tuple[BakeWarning, ...]:
    """Warn if the file just opened has scripts that were not run: it may look otherwise with them."""
    if not bpy.app.autoexec_fail or bpy.app.autoexec_fail_quiet:
        return ()
    message = f"was not run ({bpy.app.autoexec_fail_message}): give --allow-scripts if you trust the file"
    return (BakeWarning("script", message),)


def _import_gltf(path: Path) -> None:
    fault = gltf_fault(path)
    if fault is not None:
        raise SceneError(f"{path} cannot be read: {fault}; export the scene again")
    # Users may have switched the add-on off, and the bpy module may start without it.
    if addon_utils.check("io_scene_gltf2")[1] is False:
        addon_utils.enable("io_scene_gltf2", default_set=False)
    empty_scene()
    with as_they_are():
        _import(
            path,
            lambda: bpy.ops.import_scene.gltf(filepath=str(path), export_import_convert_lighting_mode="SPEC"),
        )


def _import_obj(path: Path) -> None:
    empty_scene()
    _import(path, lambda: bpy.ops.wm.obj_import(filepath=str(path)))


def _import(path: Path, operation: Callable[[], set[str]]) -> None:
    """Run an importer, its failure reported in one line that names the file and the cause."""
    cause = None
    with silenced():
        try:
            operation()
        except Exception as error:  # noqa: BLE001 - importers let any exception of a broken file through
            cause = _cause(str(error))
    if cause is not None:
        raise SceneError(f"{path} cannot be read: {cause}; is the file complete?")
    if len(bpy.data.objects) == 0:
        raise SceneError(f"{path} cannot be read: no object was found in it; is the file complete?")


def _cause(message: str) -> str:
    """Return the line of an importer's message that says what happened, without Blender's prefixes.

    Of a traceback, that is the line below its last frame, which starts at the margin.
    """
    lines = [line for line in message.splitlines() if line.strip() and not line.startswith("Location: ")]
    if any(line.endswith("Traceback (most recent call last):") for line in lines):
        lines = [line for line in lines if not line.startswith(" ") and "Traceback (most" not in line]
    return lines[-1].strip().removeprefix("Error: ").rstrip(".") if lines else "unknown error"


_OPENERS: dict[str, Callable[[Path], None]] = {
    ".blend": _open_blend,
    ".glb": _import_gltf,
    ".gltf": _import_gltf,
    ".obj": _import_obj,
}
