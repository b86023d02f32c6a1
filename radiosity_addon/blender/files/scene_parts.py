"""The files that a glTF or OBJ scene consists of besides itself.

Nothing may be written in their places, and they must be files.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from urllib.parse import unquote

from .gltf_check import gltf_tree


def scene_parts(scene: Path) -> list[Path]:
    """Return the buffers and images of a glTF scene, or the material libraries of an OBJ scene.

    A file that cannot be read has none; opening it says why.
    """
    named = _NAMED.get(scene.suffix.lower())
    found: list[Path] = []
    if named is not None:
        with suppress(OSError, ValueError, TypeError, AttributeError, KeyError, RecursionError, struct.error):
            found.extend(scene.parent / name for name in named(scene))
    return found


def _of_gltf(scene: Path) -> Iterator[str]:
    tree = gltf_tree(scene)
    for part in (*tree.get("buffers", ()), *tree.get("images", ())):
        uri = part.get("uri", "data:")
        if not uri.startswith("data:"):
            yield unquote(uri)


def _of_obj(scene: Path) -> Iterator[str]:
    with scene.open("rb") as lines:
        for line in lines:
            if line.startswith(b"mtllib"):
                yield os.fsdecode(line[len(b"mtllib") :].strip())


_NAMED = {".gltf": _of_gltf, ".glb": _of_gltf, ".obj": _of_obj}
