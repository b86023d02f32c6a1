"""Instances whose lightmap UVs differ by their place on the page alone: one mesh, an offset and a scale each.

A bake with `--pack rectangles` moves the layout of a shape by whole texels. What each object's UVs are within
its rectangle is found again from the UVs themselves: in steps of a texel they are the same integers.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..numerics import Array
from ..options import TEXEL_STEPS
from .accessors import FLOAT32, floats_of
from .glb import Glb, Json
from .lit_gltf import LIGHTMAP, LIGHTMAP_CHANNEL, ExportedNames, strip

COORDINATES = f"TEXCOORD_{LIGHTMAP_CHANNEL}"


@dataclass(frozen=True)
class LightmapPlace:
    """UV of the page = UV of the mesh · scale + offset, v up."""

    scale: tuple[float, float]
    offset: tuple[float, float]


@dataclass(frozen=True, eq=False)
class _Found:
    """A node's UVs in its rectangle, in steps: of each primitive (n, 2), v up; and the rectangle [texels]."""

    node: Json
    name: str
    page: int
    parts: list[Array]
    low: Array
    size: Array


def share_meshes(
    written: Glb, names: ExportedNames, nodes: Mapping[str, int], pages: Mapping[int, tuple[int, int]]
) -> tuple[Glb, dict[str, LightmapPlace]]:
    """Return a file in which instances share one mesh, and the places of those that do.

    nodes: Page of each object with a lightmap, by the user's name.
    pages: Width and height of each page.
    """
    glb = written.copy()
    strip(glb.json)
    digests = [hashlib.sha256(view).hexdigest() for view in glb.views]
    meshes = [node.get("mesh") for node in glb.json.get("nodes", ())]
    alike: dict[str, list[_Found]] = {}
    for node in glb.json.get("nodes", ()):
        node.get("extras", {}).pop(LIGHTMAP, None)  # of an earlier export that was imported
        name = names.nodes.get(node.get("name"), node.get("name"))
        if name not in nodes or meshes.count(node.get("mesh")) != 1:
            continue
        found = _found(glb, node, name, nodes[name], pages[nodes[name]], names)
        if found is not None:
            alike.setdefault(_key(glb, found, digests), []).append(found)
    places = {}
    for group in alike.values():
        if len(group) > 1:
            _give_local(glb, group[0])
            for each in group:
                each.node["mesh"] = group[0].node["mesh"]
                places[each.name] = place = _place(each, pages[each.page])
                each.node.setdefault("extras", {})[LIGHTMAP] = _told(each.page, place)
    glb.prune()
    return glb, places


def _found(
    glb: Glb, node: Json, name: str, page: int, size: tuple[int, int], names: ExportedNames
) -> _Found | None:
    """Read a node's UVs; None where they cannot be moved, such as if images are in them too."""
    parts = []
    for primitive in glb.json["meshes"][node["mesh"]]["primitives"]:
        material = glb.json["materials"][primitive["material"]]["name"] if "material" in primitive else ""
        if material in names.in_lightmap_uvs or primitive.get("targets"):
            return None
        uv = floats_of(glb, primitive["attributes"].get(COORDINATES), 2)
        if uv is None:
            return None
        uv[:, 1] = 1.0 - uv[:, 1]
        parts.append(np.rint(TEXEL_STEPS * uv * size).astype(np.int64))
    every = np.concatenate(parts)
    low = every.min(axis=0) // TEXEL_STEPS
    high = -(-every.max(axis=0) // TEXEL_STEPS)
    return _Found(
        node, name, page, [part - TEXEL_STEPS * low for part in parts], low, np.maximum(high - low, 1)
    )


def _key(glb: Glb, found: _Found, digests: list[str]) -> str:
    """Return the same text for nodes that can have one mesh."""
    mesh = glb.json["meshes"][found.node["mesh"]]
    primitives = []
    for primitive in mesh["primitives"]:
        accessors = {name: at for name, at in primitive["attributes"].items() if name != COORDINATES}
        accessors["indices"] = primitive.get("indices")
        stored = {}
        for name, number in accessors.items():
            if number is not None:
                accessor = glb.json["accessors"][number]
                stored[name] = {**accessor, "bufferView": digests[accessor.get("bufferView", 0)]}
        primitives.append([primitive.get("material"), primitive.get("mode"), stored])
    uv = hashlib.sha256(b"".join(part.tobytes() for part in found.parts)).hexdigest()
    return json.dumps([primitives, uv, mesh.get("extras")], sort_keys=True)


def _give_local(glb: Glb, found: _Found) -> None:
    """Give a node's mesh the UVs within its rectangle."""
    for primitive, part in zip(
        glb.json["meshes"][found.node["mesh"]]["primitives"], found.parts, strict=True
    ):
        uv = part / (TEXEL_STEPS * found.size)
        uv[:, 1] = 1.0 - uv[:, 1]
        view = glb.add_view(np.ascontiguousarray(uv, dtype="<f4").tobytes())
        glb.json["bufferViews"][view] |= {"target": 34962}
        accessor = {"bufferView": view, "componentType": FLOAT32, "count": len(uv), "type": "VEC2"}
        primitive["attributes"][COORDINATES] = glb.add("accessors", accessor)


def _place(found: _Found, size: tuple[int, int]) -> LightmapPlace:
    scale, offset = found.size / size, found.low / size
    return LightmapPlace((float(scale[0]), float(scale[1])), (float(offset[0]), float(offset[1])))


def _told(page: int, place: LightmapPlace) -> Json:
    """Return what a node's extras say: scale and offset as KHR_texture_transform has them, v down."""
    down = 1.0 - place.offset[1] - place.scale[1]
    return {"page": page, "scale": list(place.scale), "offset": [place.offset[0], down]}
