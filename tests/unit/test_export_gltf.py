"""glTF files of exports: read, changed, pruned, merged and written again."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from radiosity_addon.exports import (
    ExportedNames,
    Glb,
    GlbError,
    LightmapIndex,
    NodeEntry,
    PageEntry,
    emissive_only,
    lightmap_index,
    png_of_linear,
    with_lightmaps,
)

PNG = png_of_linear(np.ones((2, 2, 3)))


def written() -> Glb:
    """Two instances of a quad with their own lightmap coordinates, a lamp, and a material with an image."""
    positions, normals = (np.arange(12, dtype="<f4") + offset for offset in (0, 100))
    uv0, uv1, uv2 = (np.arange(8, dtype="<f4") * scale for scale in (1.0, 0.1, 0.2))
    views = [array.tobytes() for array in (positions, normals, uv0, uv1, positions, normals, uv0, uv2)]

    def accessor(view: int) -> dict[str, Any]:
        kind = "VEC3" if view % 4 < 2 else "VEC2"
        return {"bufferView": view, "componentType": 5126, "count": 4, "type": kind}

    def mesh(first: int) -> dict[str, Any]:
        names = ("POSITION", "NORMAL", "TEXCOORD_0", "TEXCOORD_1")
        attributes = {name: first + number for number, name in enumerate(names)}
        return {"name": f"mesh {first}", "primitives": [{"attributes": attributes, "material": 0}]}

    glb = Glb(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"name": "temporary", "nodes": [0, 1, 2], "extras": {"radiosity": 1, "mine": 2}}],
            "nodes": [
                {"name": "a", "mesh": 0, "extras": {"radiosity_bake": {"x": 1}}},
                {"name": "b", "mesh": 1},
                {"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}},
            ],
            "meshes": [mesh(0), mesh(4)],
            "accessors": [accessor(view) for view in range(8)],
            "bufferViews": [{"buffer": 0, "byteLength": len(view)} for view in views],
            "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
            "extensionsUsed": ["KHR_lights_punctual"],
            "materials": [
                {
                    "name": "material",
                    "pbrMetallicRoughness": {
                        "baseColorTexture": {"index": 0},
                        "roughnessFactor": 0.3,
                        "metallicFactor": 1.0,
                    },
                    "alphaMode": "MASK",
                    "normalTexture": {"index": 0},
                }
            ],
        },
        views,
    )
    glb.add("textures", {"source": glb.add_image(PNG, "checks")})
    return glb


NAMES = ExportedNames(
    "Room", {"a": "Tree", "b": "Tree.001"}, {"mesh 0": "Tree"}, {"material": ("Bark", 0)}, ["material"]
)


def read_back(glb: Glb) -> Glb:
    return Glb.of_bytes(glb.to_bytes())


def test_a_file_is_read_as_it_was_written() -> None:
    glb = written()
    again = read_back(glb)
    assert again.views == glb.views
    assert again.json["nodes"] == glb.json["nodes"]
    assert again.to_bytes() == glb.to_bytes()
    assert len(glb.to_bytes()) % 4 == 0


@pytest.mark.parametrize("data", [b"", b"glTF", b"x" * 40, written().to_bytes()[:100]])
def test_anything_else_is_refused(data: bytes) -> None:
    with pytest.raises(GlbError):
        Glb.of_bytes(data)


def test_equal_parts_of_instances_are_stored_once() -> None:
    glb = written()
    glb.merge_equal()
    assert len(glb.json["accessors"]) == 5
    assert len(glb.views) == 6  # five, and the image
    first, second = (mesh["primitives"][0]["attributes"] for mesh in glb.json["meshes"])
    assert {name for name in first if first[name] != second[name]} == {"TEXCOORD_1"}


def test_wholly_equal_meshes_become_one() -> None:
    glb = written()
    glb.views[7] = glb.views[3]
    glb.merge_equal()
    assert len(glb.json["meshes"]) == 1
    assert [node.get("mesh") for node in glb.json["nodes"]] == [0, 0, None]


def test_materials_name_their_lightmap_and_keep_their_shine() -> None:
    glb = read_back(with_lightmaps(written(), NAMES, {0: "lightmap.ktx2"}, lamps=False))
    (material,) = glb.json["materials"]
    info = material["extensions"]["MOZ_lightmap"]
    assert (info["texCoord"], info["intensity"]) == (1, math.pi)
    texture = glb.json["textures"][info["index"]]
    assert glb.json["images"][texture["source"]]["uri"] == "lightmap.ktx2"
    assert material["extras"]["lightmap"]["file"] == "lightmap.ktx2"
    assert material["pbrMetallicRoughness"]["roughnessFactor"] == 0.3
    assert material["name"] == "Bark"
    assert [node["name"] for node in glb.json["nodes"]] == ["Tree", "Tree.001", "lamp"]
    assert glb.json["extensionsUsed"] == ["MOZ_lightmap"]


def test_materials_name_the_light_group_of_their_emission() -> None:
    (own,) = {*NAMES.materials}
    names = replace(NAMES, light_groups={own: "Evening"})
    glb = read_back(with_lightmaps(written(), names, {0: "lightmap.ktx2"}, lamps=False))
    assert glb.json["materials"][0]["extras"]["lightmap"]["light_group"] == "Evening"
    glb = read_back(with_lightmaps(written(), NAMES, {0: "lightmap.ktx2"}, lamps=False))
    assert "light_group" not in glb.json["materials"][0]["extras"]["lightmap"]


def test_nothing_of_ours_stays_in_extras_but_the_lightmap() -> None:
    text = json.dumps(with_lightmaps(written(), NAMES, {0: "lightmap.ktx2"}, lamps=True).json)
    assert "radiosity" not in text
    assert '"mine": 2' in text


def test_lamps_go_or_stay() -> None:
    gone, kept = (
        with_lightmaps(written(), NAMES, {0: "a.ktx2"}, lamps=lamps).json for lamps in (False, True)
    )
    assert "KHR_lights_punctual" not in json.dumps(gone)
    assert len(gone["nodes"]) == 3
    assert kept["nodes"][2]["extensions"] == {"KHR_lights_punctual": {"light": 0}}
    assert "KHR_lights_punctual" in kept["extensionsUsed"]


def test_a_baked_file_emits_and_reflects_nothing() -> None:
    glb = read_back(emissive_only(written(), NAMES, [(PNG, 7.5)], {(0, 0): 0, (1, 0): 0}))
    (material,) = glb.json["materials"]
    assert material["emissiveFactor"] == [1.0, 1.0, 1.0]
    assert material["emissiveTexture"]["texCoord"] == 1
    assert material["extensions"]["KHR_materials_emissive_strength"] == {"emissiveStrength": 7.5}
    assert material["extensions"]["KHR_materials_specular"] == {"specularFactor": 0.0}
    surface = material["pbrMetallicRoughness"]
    assert surface["baseColorFactor"] == [0.0, 0.0, 0.0, 1.0]
    assert "baseColorTexture" in surface, "cut-outs stay"
    assert "normalTexture" not in material
    assert set(glb.json["extensionsUsed"]) == set(material["extensions"])


def test_the_index_says_all_that_an_importer_needs() -> None:
    page = PageEntry(64, 32, "lightmap.exr", "lightmap.ktx2")
    told = json.loads(
        lightmap_index(LightmapIndex("all", [page], [NodeEntry("Tree", 0)], baked_lights=["Sun"]))
    )
    assert told["version"] == 1
    assert told["quantity"] == "irradiance_over_pi"
    assert told["pages"] == [{"width": 64, "height": 32, "exr": "lightmap.exr", "ktx2": "lightmap.ktx2"}]
    node = {"node": "Tree", "page": 0, "texCoord": 1, "scale": [1.0, 1.0], "offset": [0.0, 0.0]}
    assert told["nodes"] == [node]
    assert told["baked_lights"] == ["Sun"]
