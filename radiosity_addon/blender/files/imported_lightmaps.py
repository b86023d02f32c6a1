"""File → Import → glTF of an exported scene: materials show the lightmap that they name.

They emit base color × lightmap + emission, as in the export; the imported shader stays in the tree, unlinked.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...exports import read_ktx2

SECOND_LAYER = "UVMap.001"
"""What Blender's importer calls TEXCOORD_1."""

LARGEST = 2**30
"""Bytes of a lightmap that is read."""

_suspended: list[None] = []


@contextmanager
def as_they_are() -> Iterator[None]:
    """Import materials as their file has them: to bake the scene again."""
    _suspended.append(None)
    try:
        yield
    finally:
        _suspended.pop()


class LightmapImport:
    """The hooks for Blender's glTF importer, made for each import."""

    def __init__(self) -> None:
        self._images: dict[Path, bpy.types.Image | None] = {}

    def gather_import_material_after_hook(
        self, gltf_material: Any, _vertex_color: Any, material: bpy.types.Material, gltf: Any
    ) -> None:
        """Show the lightmap that a material names."""
        named = (gltf_material.extras or {}).get("lightmap")
        if _suspended or not isinstance(named, dict) or material is None:
            return
        file = named.get("file")
        if not isinstance(file, str) or Path(file).name != file or named.get("texCoord") != 1:
            return
        path = Path(gltf.filename).parent / file
        if path not in self._images:
            self._images[path] = _image(path)
        image = self._images[path]
        if image is not None:
            show_lightmap(material, image)

    def gather_import_node_after_hook(
        self, _vnode: Any, gltf_node: Any, obj: bpy.types.Object | None, _gltf: Any
    ) -> None:
        """Put the UVs of an instance where its place on the page is, in a mesh of its own."""
        told = (getattr(gltf_node, "extras", None) or {}).get("lightmap")
        if _suspended or obj is None or obj.type != "MESH" or not isinstance(told, dict):
            return
        try:
            scale, offset = (np.array(told[key], dtype=np.float64).reshape(2) for key in ("scale", "offset"))
        except (KeyError, TypeError, ValueError):
            return
        if SECOND_LAYER in obj.data.uv_layers:
            obj.data = obj.data.copy()
            _move_uvs(obj.data, scale, offset)
        if "lightmap" in obj:
            del obj["lightmap"]


def _move_uvs(mesh: bpy.types.Mesh, scale: np.ndarray, offset: np.ndarray) -> None:
    """Scale and move UVs as KHR_texture_transform does, whose v points down."""
    # Written through the UV layer, they would also change in the mesh that this is a copy of (Blender 5.0).
    uvs = mesh.attributes[SECOND_LAYER].data
    uv = np.empty(2 * len(uvs), dtype=np.float32)
    uvs.foreach_get("vector", uv)
    place = (offset[0], 1.0 - offset[1] - scale[1])
    uvs.foreach_set("vector", (uv.reshape(-1, 2) * scale + place).astype(np.float32).ravel())


def _image(path: Path) -> bpy.types.Image | None:
    """Return a lightmap as an image that is packed into the file; None if it is no KTX2 of ours."""
    try:
        if not path.is_file() or path.stat().st_size > LARGEST:
            return None
        colors = read_ktx2(path.read_bytes())
    except (OSError, ValueError, IndexError):
        return None
    height, width = colors.shape[:2]
    image = bpy.data.images.new(path.name, width, height, alpha=False, float_buffer=True, is_data=True)
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :3] = colors
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.file_format = "OPEN_EXR"
    image.pack()
    return image


def show_lightmap(material: bpy.types.Material, image: bpy.types.Image) -> None:
    """Have a material of Blender's importer emit base color × lightmap + emission."""
    tree = material.node_tree
    output = None if tree is None else tree.get_output_node("ALL")
    shader = None if tree is None else next((n for n in tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
    if output is None or shader is None:
        return
    nodes, links = tree.nodes, tree.links
    uv, texture = nodes.new("ShaderNodeUVMap"), nodes.new("ShaderNodeTexImage")
    uv.uv_map = SECOND_LAYER
    texture.image, texture.extension = image, "EXTEND"
    links.new(uv.outputs["UV"], texture.inputs["Vector"])
    product, scaled, total = (nodes.new("ShaderNodeVectorMath") for _ in range(3))
    product.operation, scaled.operation, total.operation = "MULTIPLY", "SCALE", "ADD"
    links.new(texture.outputs["Color"], product.inputs[0])
    _feed(tree, shader.inputs["Base Color"], product.inputs[1])
    _feed(tree, shader.inputs["Emission Color"], scaled.inputs["Vector"])
    _feed(tree, shader.inputs["Emission Strength"], scaled.inputs["Scale"])
    links.new(product.outputs["Vector"], total.inputs[0])
    links.new(scaled.outputs["Vector"], total.inputs[1])
    emission, clear, mix = (
        nodes.new(f"ShaderNode{kind}") for kind in ("Emission", "BsdfTransparent", "MixShader")
    )
    links.new(total.outputs["Vector"], emission.inputs["Color"])
    _feed(tree, shader.inputs["Alpha"], mix.inputs[0])
    links.new(clear.outputs[0], mix.inputs[1])
    links.new(emission.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], output.inputs["Surface"])


def _feed(tree: bpy.types.NodeTree, source: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> None:
    """Have an input read what another one reads."""
    if source.is_linked:
        tree.links.new(source.links[0].from_socket, target)
    elif source.type == "RGBA" and target.type == "VECTOR":
        target.default_value = source.default_value[:3]
    else:
        target.default_value = source.default_value
