"""The digest of all that a file holds: every edit that a bake may read changes it, and nothing else does."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import bpy
import pytest

from radiosity_addon.blender.apply.content_digest import content_digest
from tests.blender.exporting import add_cube, scatter_nodes
from tests.blender.scenes import add_node, shader_material


@pytest.fixture
def scene(registered: None, tmp_path: Path) -> None:
    """A rigged cube with two UV layers, weights, a driver and a modifier of nodes, a lamp and a curve."""
    cube = add_cube()
    for name in ("First", "Second"):
        cube.data.uv_layers.new(name=name)
    cube.vertex_groups.new(name="Bone").add([0, 1], 0.5, "REPLACE")
    cube.data.materials.append(shader_material("Paint", "ShaderNodeBsdfPrincipled"))
    bpy.ops.object.armature_add()
    rig = bpy.context.object
    rig.name = "Rig"
    cube.modifiers.new("Rig", "ARMATURE").object = rig
    nodes = scatter_nodes(None)
    nodes.interface.new_socket("Size", in_out="INPUT", socket_type="NodeSocketFloat")
    cube.modifiers.new("Scatter", "NODES").node_group = nodes
    constraint = rig.pose.bones[0].constraints.new("COPY_LOCATION")
    constraint.influence = 0.5
    driver = cube.driver_add("location", 2).driver
    driver.expression = "1.0"
    curve = bpy.data.curves.new("Path", "CURVE")
    curve.dimensions = "3D"
    curve.splines.new("BEZIER").bezier_points.add(1)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Path", curve))
    bpy.context.scene["power"] = bpy.context.view_layer["power"] = 1.0
    paint = next(node for node in cube.data.materials[0].node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    drive(paint.inputs["Emission Strength"], "default_value", "render.resolution_x")
    cube.shape_key_add(name="Basis")
    drive(cube.shape_key_add(name="Swollen"), "value", "render.dither_intensity")
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "SPOT"))
    bpy.context.scene.collection.objects.link(lamp)
    bpy.context.scene.collection.children.link(bpy.data.collections.new("Lit"))
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))


def drive(owner: bpy.types.bpy_struct, name: str, by: str) -> None:
    """Let a value follow one of the scene's, by its data path."""
    driver = owner.driver_add(name).driver
    driver.type = "AVERAGE"  # needs no script
    target = driver.variables.new().targets[0]
    target.id_type, target.id, target.data_path = "SCENE", bpy.context.scene, by


def cube() -> bpy.types.Object:
    return bpy.data.objects["Cube"]


def bone() -> bpy.types.PoseBone:
    return bpy.data.objects["Rig"].pose.bones[0]


def set_size() -> None:
    nodes = cube().modifiers["Scatter"]
    (item,) = [each for each in nodes.node_group.interface.items_tree if each.name == "Size"]
    if bpy.app.version >= (5, 2):
        getattr(nodes.properties.inputs, item.identifier).value = 0.75
    else:
        nodes[item.identifier] = 0.75


def mix_in() -> None:
    add_node(bpy.data.materials["Paint"].node_tree, "ShaderNodeTexNoise")


EDITS: dict[str, Callable[[], object]] = {
    "pose": lambda: setattr(bone(), "location", (0, 0, 1)),
    "constraint": lambda: setattr(bone().constraints[0], "influence", 0.7),
    "target": lambda: setattr(bone().constraints[0], "target", bpy.data.objects["Lamp"]),
    "driver": lambda: setattr(cube().animation_data.drivers[0].driver, "expression", "2.0"),
    "driven emission": lambda: setattr(bpy.context.scene.render, "resolution_x", 77),
    "driven shape key": lambda: setattr(bpy.context.scene.render, "dither_intensity", 0.5),
    "property of the scene": lambda: bpy.context.scene.__setitem__("power", 2.0),
    "property of the view layer": lambda: bpy.context.view_layer.__setitem__("power", 2.0),
    "weight": lambda: cube().vertex_groups["Bone"].add([1], 0.6, "REPLACE"),
    "rendered UV layer": lambda: setattr(cube().data.uv_layers["Second"], "active_render", True),
    "UV": lambda: setattr(cube().data.uv_layers["First"].uv[0], "vector", (0.3, 0.4)),
    "input of nodes": set_size,
    "switched off modifier": lambda: setattr(cube().modifiers["Rig"], "show_render", False),
    "order of modifiers": lambda: cube().modifiers.move(0, 1),
    "node": mix_in,
    "point of a curve": lambda: setattr(bpy.data.curves["Path"].splines[0].bezier_points[1], "co", (1, 2, 3)),
    "angle of a lamp": lambda: setattr(bpy.data.lights["Lamp"], "spot_size", 0.5),
    "light linking": lambda: setattr(
        bpy.data.objects["Lamp"].light_linking, "receiver_collection", bpy.data.collections["Lit"]
    ),
    "ray visibility": lambda: setattr(cube(), "visible_shadow", False),
    "frame": lambda: bpy.context.scene.frame_set(7),
    "simplify": lambda: setattr(bpy.context.scene.render, "use_simplify", True),
    "sky of the view layer": lambda: setattr(bpy.context.view_layer, "use_sky", False),
    "collection": lambda: bpy.data.collections["Lit"].objects.link(cube()),
}


@pytest.mark.parametrize("edit", EDITS)
def test_edits_change_it(scene: None, edit: str) -> None:
    before = content_digest()
    assert before
    EDITS[edit]()
    bpy.context.view_layer.update()
    assert content_digest() != before


def test_what_no_bake_reads_leaves_it(scene: None) -> None:
    before = content_digest()
    for obj in bpy.context.scene.objects:
        obj.select_set(not obj.select_get())
    bpy.context.view_layer.objects.active = cube()
    bpy.context.scene.render.filepath = "/tmp/elsewhere"
    bpy.context.scene.radiosity.resolution = 64
    bpy.data.lights.new("Unused", "POINT")
    bpy.context.view_layer.update()
    bpy.context.evaluated_depsgraph_get()
    assert content_digest() == before
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    assert content_digest() == before
    bpy.context.view_layer.update()
    assert content_digest() == before


def test_painted_pixels_that_are_not_saved_cannot_be_known(scene: None, tmp_path: Path) -> None:
    image = bpy.data.images.new("Painted", 2, 2)
    add_node(bpy.data.materials["Paint"].node_tree, "ShaderNodeTexImage").image = image
    image.pixels[0] = 0.5
    assert content_digest() is None
    image.filepath_raw, image.file_format = str(tmp_path / "painted.png"), "PNG"
    image.save()
    before = content_digest()
    assert before
    image.pack()
    assert content_digest() not in (None, before)


def test_a_tile_that_was_painted_changes_it(scene: None, tmp_path: Path) -> None:
    tiles = [tmp_path / f"tile.{number}.png" for number in (1001, 1002)]
    for tile in tiles:
        made = bpy.data.images.new("Tile", 2, 2)
        made.filepath_raw, made.file_format = str(tile), "PNG"
        made.save()
        bpy.data.images.remove(made)
    image = bpy.data.images.load(str(tiles[0]))
    image.source = "TILED"
    image.filepath = str(tmp_path / "tile.<UDIM>.png")
    add_node(bpy.data.materials["Paint"].node_tree, "ShaderNodeTexImage").image = image
    before = content_digest()
    assert content_digest() == before
    os.utime(tiles[1], ns=(10**18, 10**18))
    assert content_digest() not in (None, before)


def test_what_cannot_be_read_cannot_be_known(scene: None) -> None:
    """A property of an add-on's whose struct holds itself."""
    holder = type("Holder", (bpy.types.PropertyGroup,), {})
    bpy.utils.register_class(holder)
    holder.inner = bpy.props.PointerProperty(type=holder)
    bpy.types.Object.itself = bpy.props.PointerProperty(type=holder)
    try:
        assert content_digest() is None
    finally:
        del bpy.types.Object.itself
        bpy.utils.unregister_class(holder)
    assert content_digest()
