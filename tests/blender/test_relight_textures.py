"""Relight notices textures and UV maps that changed since the bake."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.blender.scenes import add_lamp, add_mesh, shader_material

pytestmark = pytest.mark.usefixtures("registered")


@pytest.mark.parametrize("change", ["flipped", "swapped"])
def test_textures_and_uvs_that_changed_are_noticed(tmp_path: Path, change: str) -> None:
    """Relighting is refused, and the message names the object."""
    # Of each triangle one half is dark, whichever way the picture is mirrored.
    checker = bpy.data.images.new("Checker", 8, 8)
    pixels = np.ones((8, 8, 4), dtype=np.float32)
    pixels[:4, :4, :3] = pixels[4:, 4:, :3] = 0.05
    checker.pixels.foreach_set(pixels.ravel())
    floor = shader_material("Checkered", "ShaderNodeBsdfDiffuse")
    tree = floor.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = checker, "Closest"
    (diffuse,) = (node for node in tree.nodes if node.type == "BSDF_DIFFUSE")
    tree.links.new(texture.outputs["Color"], diffuse.inputs["Color"])
    obj = add_mesh("Floor", material=floor)
    add_mesh("Wall", rotation_euler=(1.57, 0, 0), location=(0, 1, 0.5), scale=(1, 0.5, 1))
    add_lamp("POINT", "Bulb", {"location": (0, 0, 1)}, energy=40.0)
    uv = obj.data.uv_layers.new(name="UVMap")
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float32)
    uv.data.foreach_set("uv", corners[: len(uv.data)].ravel())
    bpy.context.scene.radiosity.resolution, bpy.context.scene.radiosity.quality = 16, "sketch"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT") == {"FINISHED"}
    bpy.data.objects["Bulb"].data.energy = 50.0
    assert bpy.ops.radiosity.relight("EXEC_DEFAULT") == {"FINISHED"}
    if change == "swapped":
        checker.pixels.foreach_set(np.ascontiguousarray(pixels[:, ::-1]).ravel())
        checker.update()
    else:
        layer = bpy.data.objects["Floor"].data.uv_layers["UVMap"]
        layer.data.foreach_set("uv", (abs((1.0, 0.0) - corners)).astype(np.float32).ravel())
    with pytest.raises(RuntimeError, match=r"object 'Floor'.*: bake again"):
        bpy.ops.radiosity.relight("EXEC_DEFAULT")
