"""The two glTF files: materials that name their lightmap, and the one that any viewer shows lit.

The glTF standard has no lightmaps. `MOZ_lightmap` is what viewers that know any read; its texture is a file
next to the .glb, as the standard allows no HDR image in it. The material's `extras` say the same.
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from .glb import Glb, Json

LIGHTMAP_CHANNEL = 1
"""Of the texture coordinates: engines look for a lightmap's in the second set."""

LIGHTMAP = "lightmap"
"""The key of a material's `extras`."""

OURS = "radiosity"
"""What the names of custom properties begin with that only Blender needs."""

LAMPS = "KHR_lights_punctual"
EMISSIVE_STRENGTH = "KHR_materials_emissive_strength"
SPECULAR = "KHR_materials_specular"
MOZ_LIGHTMAP = "MOZ_lightmap"

_CLAMPED = {"magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071}
"""A sampler: linear, without mip levels, clamped to the edge."""


@dataclass(frozen=True)
class ExportedNames:
    """What is meant by the names in a file that Blender has written from a temporary scene.

    scene: The name of the scene.
    nodes, meshes mapping of str to str: Their names in the user's file.
    materials mapping of str to (str, int or None): The same, and the page of their lightmap.
    in_lightmap_uvs: Those materials, by their names in the written file, with images in the lightmap's UVs.
    light_groups mapping of str to str: The light group of those whose emission is in one.
    """

    scene: str = ""
    nodes: Mapping[str, str] = field(default_factory=dict)
    meshes: Mapping[str, str] = field(default_factory=dict)
    materials: Mapping[str, tuple[str, int | None]] = field(default_factory=dict)
    in_lightmap_uvs: Collection[str] = ()
    light_groups: Mapping[str, str] = field(default_factory=dict)


def with_lightmaps(written: Glb, names: ExportedNames, files: Mapping[int, str], *, lamps: bool) -> Glb:
    """Return a written file with the user's names, and materials that name their lightmaps.

    files mapping of int to str: The file of each page.
    lamps: Whether lamps stay: those that are not in the lightmap.
    """
    glb = written.copy()
    strip(glb.json)
    if not lamps:
        _remove_lamps(glb.json)
    _rename(glb.json, names)
    textures: dict[int, int] = {}
    for material in glb.json.get("materials", ()):
        group = names.light_groups.get(material["name"])
        material["name"], page = names.materials.get(material["name"], (material["name"], None))
        if page is None:
            continue
        if page not in textures:
            image = glb.add("images", {"name": f"Lightmap {page}", "uri": files[page]})
            sampler = glb.add("samplers", dict(_CLAMPED))
            textures[page] = glb.add("textures", {"source": image, "sampler": sampler})
        _name_lightmap(material, page, textures[page], files[page])
        if group is not None:
            material["extras"][LIGHTMAP]["light_group"] = group
        glb.uses(MOZ_LIGHTMAP)
    glb.merge_equal()
    return glb


def _rename(content: Json, names: ExportedNames) -> None:
    """Give the scene, nodes and meshes the user's names."""
    for scene in content.get("scenes", ()):
        scene["name"] = names.scene
    for kind, known in (("nodes", names.nodes), ("meshes", names.meshes)):
        for item in content.get(kind, ()):
            if item.get("name") in known:
                item["name"] = known[item["name"]]


def _name_lightmap(material: Json, page: int, texture: int, file: str) -> None:
    intensity = math.pi  # what viewers divide by π
    info = {"index": texture, "texCoord": LIGHTMAP_CHANNEL, "intensity": intensity}
    material.setdefault("extensions", {})[MOZ_LIGHTMAP] = info
    told = {"file": file, "page": page, "texCoord": LIGHTMAP_CHANNEL, "intensity": intensity}
    material.setdefault("extras", {})[LIGHTMAP] = told


def emissive_only(
    written: Glb,
    names: ExportedNames,
    images: Sequence[tuple[bytes, float]],
    read_by: Mapping[tuple[int, int], int],
) -> Glb:
    """Return a written file in which baked materials emit what leaves them, and reflect nothing.

    images: In sRGB, each with the radiance of white.
    read_by: Which of them a primitive reads that emits, by the numbers of its mesh and in that.
    """
    glb = written.copy()
    strip(glb.json)
    _remove_lamps(glb.json)
    _rename(glb.json, names)
    textures = []
    for number, (png, _) in enumerate(images):
        image, sampler = glb.add_image(png, f"Light {number}"), glb.add("samplers", dict(_CLAMPED))
        textures.append(glb.add("textures", {"source": image, "sampler": sampler}))
    made: dict[tuple[int, int], int] = {}
    for (mesh, place), number in read_by.items():
        primitive = glb.json["meshes"][mesh]["primitives"][place]
        key = primitive["material"], number
        if key not in made:
            material = json.loads(json.dumps(glb.json["materials"][key[0]]))
            _emit(material, textures[number], images[number][1])
            made[key] = glb.add("materials", material)
            glb.uses(EMISSIVE_STRENGTH)
            glb.uses(SPECULAR)
        primitive["material"] = made[key]
    for material in glb.json.get("materials", ()):
        material["name"], _ = names.materials.get(material["name"], (material["name"], None))
    glb.merge_equal()
    return glb


def _emit(material: Json, texture: int, strength: float) -> None:
    """Make a material black and emitting; of what it was, its cut-outs stay."""
    before = material.get("pbrMetallicRoughness", {})
    alpha = before.get("baseColorFactor", [1.0] * 4)[3]
    surface: dict[str, Any] = {"baseColorFactor": [0.0, 0.0, 0.0, alpha], "metallicFactor": 0.0}
    if material.get("alphaMode", "OPAQUE") != "OPAQUE" and "baseColorTexture" in before:
        surface["baseColorTexture"] = before["baseColorTexture"]
    for key in ("normalTexture", "occlusionTexture", "extras"):
        material.pop(key, None)
    material["pbrMetallicRoughness"] = surface
    material["emissiveFactor"] = [1.0, 1.0, 1.0]
    material["emissiveTexture"] = {"index": texture, "texCoord": LIGHTMAP_CHANNEL}
    material["extensions"] = {
        EMISSIVE_STRENGTH: {"emissiveStrength": strength},
        SPECULAR: {"specularFactor": 0.0},
    }


def strip(content: Json) -> None:
    """Remove our custom properties: they are for Blender."""
    for kind in ("scenes", "nodes", "meshes", "materials", "cameras", "images", "animations"):
        for item in content.get(kind, ()):
            extras = {key: value for key, value in item.pop("extras", {}).items() if not key.startswith(OURS)}
            if extras:
                item["extras"] = extras


def _remove_lamps(content: Json) -> None:
    """Remove lamps, but not their nodes: others may be children of these."""
    for holder in (content, *content.get("nodes", ())):
        extensions = holder.get("extensions", {})
        extensions.pop(LAMPS, None)
        if not extensions:
            holder.pop("extensions", None)
