"""The result of a prepared bake in its spool, under the digest of its inputs.

Of its objects only names are stored: the scene brings them again. What overlays show of a bake in an open
window is left out.
"""

from __future__ import annotations

import json
import os
import uuid
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..bake.result import BakedObject, BakeResult, LightGroup
from ..bake.sidecar import check_result
from ..base import BakeError
from ..numerics import Array
from ..options import BakeSettings
from ..scene import BakeScene
from .objects import ObjectError, Reader, Writer, digest_of
from .prepared import UNREADABLE
from .spool import Spool
from .spool_store import explained, not_written

FOLDER = "results"

AS_THEY_ARE = ("pages", "warnings")
PLAIN = ("solver", "seconds", "atlas", "light", "coincident", "performance")


@dataclass(frozen=True, eq=False)
class StoredResult:
    """A bake's result as a spool has it, not yet tied to a scene.

    mark: The bake's own name (`KeepOptions`); "" if it was not kept.
    sidecar: The bytes of its file, if the bake was kept.
    fields: What `result` makes a `BakeResult` of.
    """

    mark: str
    sidecar: Array | None
    fields: Mapping[str, Any] = field(repr=False)

    @classmethod
    def read(cls, spool: Spool, inputs: str) -> StoredResult:
        """Read the result for some inputs from a spool. Raises ValueError and others if it is damaged."""
        digest = spool.pointer(f"{FOLDER}/{inputs}")
        if digest is None:
            raise ObjectError("no result")
        stored = Reader(spool).value(json.loads(spool.object(digest)))
        mark, sidecar = stored["mark"], stored["sidecar"]
        if mark != "" and uuid.UUID(hex=mark).hex != mark:
            raise ObjectError("no mark")
        if sidecar is not None and (sidecar.dtype != np.uint8 or sidecar.ndim != 1):
            raise ObjectError("no bytes of a file")
        return cls(mark, sidecar, stored["result"])

    @classmethod
    def is_whole(cls, spool: Spool, inputs: str, bake_scene: BakeScene, settings: BakeSettings) -> bool:
        """Return whether there is a result for some inputs, of this scene, that is not damaged."""
        try:
            cls.read(spool, inputs).result(bake_scene, settings)
        except UNREADABLE:
            return False
        return True

    def result(self, bake_scene: BakeScene, settings: BakeSettings) -> BakeResult:
        """Return the result of a bake of this scene. Raises ValueError and others if it is of another one."""
        stored, items = self.fields, {item.name: item for item in bake_scene.objects}
        objects = tuple(BakedObject(items[name], *facts) for name, *facts in stored["objects"])
        groups = tuple(LightGroup(*group) for group in stored["groups"])
        others = {name: stored[name] for name in (*AS_THEY_ARE, *PLAIN)}
        found = BakeResult(objects=objects, groups=groups, **others)
        check_result(found, bake_scene, settings)
        return found

    def write_sidecar(self, path: Path) -> None:
        """Write the sidecar's file. Raises BakeError if there is none, or it cannot be written."""
        if self.sidecar is None:
            raise BakeError("the bake was not kept: prepare it again, with --keep")
        try:
            self.sidecar.tofile(path)
        except OSError as error:
            raise BakeError(f"cannot write '{path}': {error.strerror or 'its disk may be full'}") from error


def write_result(spool: Spool, inputs: str, result: BakeResult, mark: str, sidecar: Path | None) -> None:
    """Write a result to a spool.

    sidecar: The bake's file, if it was kept; it may go afterwards.
    Raises BakeError if it cannot be written.
    """
    stored = {
        "objects": [
            (each.object.name, each.uv, each.page, each.density, each.share) for each in result.objects
        ],
        "groups": [(group.name, group.pages, group.sources) for group in result.groups],
        **{name: getattr(result, name) for name in AS_THEY_ARE},
        **{name: _plain(getattr(result, name)) for name in PLAIN},
    }
    try:
        file = None if sidecar is None else np.memmap(sidecar, np.uint8, mode="r")
    except OSError as error:
        raise not_written(spool.path, error) from error
    tree = Writer(spool).tree({"mark": mark, "sidecar": file, "result": stored})
    text = json.dumps(tree)
    digest = digest_of(text)
    spool.put_object(digest, text)
    spool.point(f"{FOLDER}/{inputs}", digest)


def forget_result(spool: Spool, inputs: str) -> None:
    """Forget the result for some inputs, which is damaged. Raises BakeError if it cannot be removed."""
    with explained(spool.path), suppress(FileNotFoundError):
        (spool.path / FOLDER / inputs).unlink()


def has_result(spool: Spool, inputs: str) -> bool:
    """Return whether there is a result for some inputs, damaged or not."""
    return os.path.lexists(spool.path / FOLDER / inputs)


def _plain(value: Any) -> Any:
    """Turn NumPy's numbers and arrays, and kinds of dictionaries, into plain ones."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return type(value)(_plain(item) for item in value)
    return value
