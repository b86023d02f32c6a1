"""A look at a glTF file before it is imported: does what it refers to exist, and is it large enough?

Blender's importer trusts the counts in the file: one that claims a billion vertices takes all memory.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

_COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}

_JSON_CHUNK = 0x4E4F534A

MAX_FREE_BYTES = 2**30
"""Largest accessor that no buffer backs: its zeros take no space in the file."""


def gltf_fault(path: Path) -> str | None:
    """Say what is wrong with a .gltf or .glb file; None for what its importer can judge.

    Returns fault: In words that follow the file's name.
    """
    try:
        tree = gltf_tree(path)
    except (ValueError, struct.error, RecursionError):
        return None  # the importer says where
    if not isinstance(tree, dict):
        return "it holds no glTF scene"
    try:
        return next(_faults(tree), None)
    except (TypeError, AttributeError, KeyError, IndexError, ValueError):
        return "its parts do not fit together"


def gltf_tree(path: Path) -> Any:
    """Return the JSON of a .gltf or .glb file.

    Raises OSError, ValueError, RecursionError or struct.error if there is none.
    """
    return json.loads(_json_of(path.read_bytes()))


def _json_of(content: bytes) -> bytes:
    """Return the JSON part of a file of either kind."""
    if content[:4] != b"glTF":
        return content
    length, kind = struct.unpack_from("<II", content, 12)
    if kind != _JSON_CHUNK:
        raise ValueError("no JSON chunk")
    return content[20 : 20 + length]


def _faults(tree: dict[str, Any]) -> Iterator[str]:
    for number, view in enumerate(tree.get("bufferViews", ())):
        buffers = tree.get("buffers", ())
        index = view["buffer"]
        if not 0 <= index < len(buffers):
            yield f"buffer view {number} refers to a buffer that does not exist"
        elif _end(view) > buffers[index]["byteLength"]:
            yield f"buffer view {number} reaches beyond its buffer"
    for number, accessor in enumerate(tree.get("accessors", ())):
        fault = _accessor_fault(accessor, tree.get("bufferViews", ()))
        if fault:
            yield f"accessor {number} {fault}"
    yield from _missing(tree)
    if _has_cycle([node.get("children", ()) for node in tree.get("nodes", ())]):
        yield "a node is its own parent"


def _end(part: dict[str, Any]) -> int:
    start, length = part.get("byteOffset", 0), part["byteLength"]
    if start < 0 or length < 0:
        raise ValueError("negative")
    return int(start + length)


def _accessor_fault(accessor: dict[str, Any], views: list[dict[str, Any]]) -> str | None:
    count = accessor["count"]
    component = _COMPONENT_BYTES.get(accessor["componentType"])
    components = _COMPONENTS.get(accessor["type"])
    if component is None or components is None:
        return "is of an unknown type"
    if not isinstance(count, int) or count < 0:
        return f"has {count} values"
    size, index = component * components, accessor.get("bufferView")
    if index is None:
        return "claims more values than fit into memory" if count * size > MAX_FREE_BYTES else None
    if not 0 <= index < len(views):
        return "refers to a buffer view that does not exist"
    view = views[index]
    stride = view.get("byteStride") or size
    needed = accessor.get("byteOffset", 0) + stride * (count - 1) + size if count else 0
    return "reaches beyond its buffer view" if needed > view["byteLength"] else None


def _missing(tree: dict[str, Any]) -> Iterator[str]:
    """Name references to nodes, meshes and accessors that are not there."""
    counts = {kind: len(tree.get(kind, ())) for kind in ("nodes", "meshes", "accessors", "materials")}
    for number, node in enumerate(tree.get("nodes", ())):
        for kind, indices in (("nodes", node.get("children", ())), ("meshes", [node.get("mesh", 0)])):
            if "mesh" not in node and kind == "meshes":
                continue
            if any(not 0 <= index < counts[kind] for index in indices):
                yield f"node {number} refers to one of the {kind} that does not exist"
    for number, scene in enumerate(tree.get("scenes", ())):
        if any(not 0 <= index < counts["nodes"] for index in scene.get("nodes", ())):
            yield f"scene {number} refers to a node that does not exist"
    for number, mesh in enumerate(tree.get("meshes", ())):
        for primitive in mesh["primitives"]:
            used = [*primitive["attributes"].values(), primitive.get("indices", 0)]
            used = used if "indices" in primitive else used[:-1]
            if any(not 0 <= index < counts["accessors"] for index in used):
                yield f"mesh {number} refers to an accessor that does not exist"
            if not 0 <= primitive.get("material", -1) < counts["materials"] and "material" in primitive:
                yield f"mesh {number} refers to a material that does not exist"


def _has_cycle(children: list[list[int]]) -> bool:
    """Return whether following children from some node leads back to it."""
    parents = [0] * len(children)
    for row in children:
        for child in row:
            if 0 <= child < len(children):
                parents[child] += 1
    # Without cycles, taking away nodes that have no parent left ends with none.
    free = [node for node, count in enumerate(parents) if count == 0]
    taken = 0
    while free:
        taken += 1
        for child in children[free.pop()]:
            if 0 <= child < len(children):
                parents[child] -= 1
                if parents[child] == 0:
                    free.append(child)
    return taken < len(children)
