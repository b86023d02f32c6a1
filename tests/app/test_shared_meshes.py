"""`--pack rectangles`: instances are one mesh in scene.glb, each with its place on the page."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.exports import Glb
from tests.trees import build_trees

from .conftest import QUICK, save

Run = Callable[..., Any]

COUNT = 60
WORDS = ("--resolution", "512", "--quality", "sketch", "--no-preview")


def floats(glb: Glb, number: int) -> np.ndarray:
    """An accessor's floats."""
    accessor = glb.json["accessors"][number]
    width = {"VEC2": 2, "VEC3": 3}[accessor["type"]]
    return np.frombuffer(glb.views[accessor["bufferView"]], "<f4").reshape(-1, width)[: accessor["count"]]


def primitives(glb: Glb) -> dict[str, list[dict[str, Any]]]:
    """Each node's primitives, by its name."""
    meshes = glb.json["meshes"]
    return {node["name"]: meshes[node["mesh"]]["primitives"] for node in glb.json["nodes"] if "mesh" in node}


@pytest.fixture(scope="module")
def trees(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Many trees, baked and exported."""
    from radiosity_addon.blender.command_line.main import main

    folder = tmp_path_factory.mktemp("trees")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)

    build_trees(COUNT)
    scene = save(folder / "trees.blend")

    words = ["bake", scene, "--output", folder, *WORDS, "--pack", "rectangles", "--export", "glb", "--quiet"]
    assert main([str(word) for word in words]) == 0
    return folder


def test_many_trees_are_one_mesh(trees: Path) -> None:
    glb = Glb.of_bytes((trees / "export" / "scene.glb").read_bytes())
    index = json.loads((trees / "export" / "lightmaps.json").read_text(encoding="utf-8"))
    nodes = {node["name"]: node for node in glb.json["nodes"]}
    assert len({nodes[f"Tree {number}"]["mesh"] for number in range(COUNT)}) == 1
    assert len(glb.json["meshes"]) == 2
    assert len({tuple(entry["offset"]) for entry in index["nodes"]}) == COUNT + 1
    assert len({tuple(entry["scale"]) for entry in index["nodes"]}) == 2
    for entry in index["nodes"]:
        told = nodes[entry["node"]].get("extras", {}).get("lightmap")
        if entry["node"] == "Ground":
            assert (told, entry["scale"], entry["offset"]) == (None, [1.0, 1.0], [0.0, 0.0])
            continue
        assert told["scale"] == entry["scale"]
        assert told["page"] == entry["page"]
        down = 1.0 - entry["offset"][1] - entry["scale"][1]
        np.testing.assert_allclose(told["offset"], (entry["offset"][0], down), atol=1e-12)


def test_the_places_lead_to_the_texels_that_were_baked(trees: Path) -> None:
    """scene_baked.glb has the UVs of the page; those of scene.glb, scaled and moved, are the same."""
    shared = Glb.of_bytes((trees / "export" / "scene.glb").read_bytes())
    whole = Glb.of_bytes((trees / "export" / "scene_baked.glb").read_bytes())
    index = json.loads((trees / "export" / "lightmaps.json").read_text(encoding="utf-8"))
    entries = {entry["node"]: entry for entry in index["nodes"]}
    of_page = primitives(whole)
    for name, own in primitives(shared).items():
        entry = entries[name]
        for one, other in zip(own, of_page[name], strict=True):
            uv, wanted = (
                floats(glb, each["attributes"]["TEXCOORD_1"]).astype(np.float64) * (1, -1) + (0, 1)
                for glb, each in ((shared, one), (whole, other))
            )
            np.testing.assert_allclose(uv * entry["scale"] + entry["offset"], wanted, atol=2e-6)
            for kind in ("POSITION", "NORMAL"):
                found = floats(shared, one["attributes"][kind])
                np.testing.assert_array_equal(found, floats(whole, other["attributes"][kind]))


def test_an_imported_scene_has_each_instance_at_its_place(trees: Path) -> None:
    index = json.loads((trees / "export" / "lightmaps.json").read_text(encoding="utf-8"))
    entry = bpy.context.preferences.addons.new()
    entry.module = radiosity_addon.__name__
    try:
        bpy.ops.import_scene.gltf(filepath=str(trees / "export" / "scene.glb"))
    finally:
        bpy.context.preferences.addons.remove(entry)
    for told in index["nodes"]:
        obj = bpy.data.objects[told["node"]]
        assert "lightmap" not in obj
        layer = obj.data.uv_layers["UVMap.001"]
        uv = np.empty(2 * len(layer.uv), np.float32)
        layer.uv.foreach_get("vector", uv)
        if told["node"] == "Ground":
            continue
        texels = 512 * uv.reshape(-1, 2).astype(np.float64)
        low = 512 * np.array(told["offset"])
        np.testing.assert_array_equal(np.floor(texels.min(axis=0) + 1e-3), low)
        np.testing.assert_array_equal(np.ceil(texels.max(axis=0) - 1e-3), low + 512 * np.array(told["scale"]))


def test_charts_share_nothing(run: Run, tmp_path: Path) -> None:
    build_trees(4)
    scene = save(tmp_path / "trees.blend")
    done = run("bake", scene, "--output", tmp_path / "out", *QUICK, "--export", "glb")
    assert done.code == 0
    index = json.loads((tmp_path / "out" / "export" / "lightmaps.json").read_text(encoding="utf-8"))
    assert all(entry["scale"] == [1.0, 1.0] for entry in index["nodes"])
