"""glTF files whose parts do not fit together are refused before the importer trusts them."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from radiosity_addon.blender.files.gltf_check import gltf_fault


def triangle() -> dict[str, Any]:
    return {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "materials": [{}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36}],
    }


def binary(tree: object) -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    header = struct.pack("<4sII", b"glTF", 2, 20 + len(text))
    return header + struct.pack("<II", len(text), 0x4E4F534A) + text


@pytest.mark.parametrize("kind", ["gltf", "glb"])
def test_a_sound_file_is_left_to_the_importer(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"scene.{kind}"
    path.write_bytes(binary(triangle()) if kind == "glb" else json.dumps(triangle()).encode())
    assert gltf_fault(path) is None


DAMAGE: dict[str, Callable[[dict[str, Any]], object]] = {
    "accessor 0 reaches": lambda tree: tree["accessors"][0].update(count=10**9),
    "accessor 0 has -3": lambda tree: tree["accessors"][0].update(count=-3),
    "accessor 0 has 2.5": lambda tree: tree["accessors"][0].update(count=2.5),
    "accessor 0 claims": lambda tree: tree.update(
        accessors=[{"componentType": 5126, "count": 10**9, "type": "VEC3"}]
    ),
    "accessor 0 is of an unknown type": lambda tree: tree["accessors"][0].update(type="VEC9"),
    "accessor 0 refers": lambda tree: tree["accessors"][0].update(bufferView=4),
    "buffer view 0 refers": lambda tree: tree["bufferViews"][0].update(buffer=-1),
    "buffer view 0 reaches": lambda tree: tree["bufferViews"][0].update(byteLength=2**40),
    "node 0 refers": lambda tree: tree["nodes"][0].update(mesh=9),
    "scene 0 refers": lambda tree: tree["scenes"][0].update(nodes=[7]),
    "mesh 0 refers to an accessor": lambda tree: tree["meshes"][0]["primitives"][0].update(indices=5),
    "mesh 0 refers to a material": lambda tree: tree["meshes"][0]["primitives"][0].update(material=5),
    "its own parent": lambda tree: tree.update(nodes=[{"children": [1]}, {"children": [0]}]),
    "do not fit": lambda tree: tree.update(nodes=[3]),
}


@pytest.mark.parametrize("says", DAMAGE)
def test_damage_is_named(says: str, tmp_path: Path) -> None:
    tree = triangle()
    DAMAGE[says](tree)
    path = tmp_path / "scene.gltf"
    path.write_text(json.dumps(tree))
    assert says in (gltf_fault(path) or "")


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"glTF", b"glTF" + b"?" * 40, b"[" * 100_000])
def test_what_is_no_gltf_is_left_to_the_importer_which_says_where(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "scene.gltf"
    path.write_bytes(content)
    assert gltf_fault(path) is None
