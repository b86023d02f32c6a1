"""Numbers in a binary glTF file, where they are stored plainly."""

from __future__ import annotations

import numpy as np

from ..numerics import Array
from .glb import Glb

FLOAT32 = 5126
_INTEGERS = {5121: "u1", 5123: "<u2", 5125: "<u4"}
_WIDTHS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


def floats_of(glb: Glb, number: int | None, width: int) -> Array | None:
    """Return an accessor's floats (n, width) float64; None if it is stored otherwise."""
    return _numbers(glb, number, width, {FLOAT32: "<f4"}, np.float64)


def indices_of(glb: Glb, number: int | None) -> Array | None:
    """Return the numbers of vertices (n,) int64 in an accessor; None if it is stored otherwise."""
    found = _numbers(glb, number, 1, _INTEGERS, np.int64)
    return None if found is None else found[:, 0]


def _numbers(glb: Glb, number: int | None, width: int, kinds: dict[int, str], kind: type) -> Array | None:
    if number is None:
        return None
    accessor = glb.json["accessors"][number]
    stored = kinds.get(accessor["componentType"])
    if stored is None or accessor["type"] != _WIDTHS[width] or "sparse" in accessor:
        return None
    view = accessor.get("bufferView")
    if view is None or accessor.get("byteOffset") or glb.json["bufferViews"][view].get("byteStride"):
        return None
    return np.frombuffer(glb.views[view], stored, width * accessor["count"]).reshape(-1, width).astype(kind)
