"""A file with one of everything that a bake must bring back exactly."""

from __future__ import annotations

import bpy
from mathutils import Matrix


def build_zoo(context: bpy.types.Context) -> None:
    """Fill the open, empty file."""
    brick, image = _textured_material("Brick"), bpy.data.materials.new("Plain")
    image.diffuse_color = (0.1, 0.2, 0.3, 1.0)
    cube = _cube("Cube", (0, 0, 0), [brick, None, image])
    _uv_layers(cube.data)
    cube.data.polygons.foreach_set("material_index", [0, 1, 2, 0, 1, 2])
    cube.scale = (1, -2, 0.5)
    cube["note"] = "mine"

    duplicate = bpy.data.objects.new("Duplicate", cube.data)
    duplicate.location = (4, 0, 0)
    duplicate.parent = cube
    context.scene.collection.objects.link(duplicate)
    duplicate.material_slots[0].link = "OBJECT"
    duplicate.material_slots[0].material = bpy.data.materials.new("Of the Object")
    duplicate.active_material_index = 2

    keyed = _cube("Keyed", (8, 0, 0), [])
    keyed.shape_key_add(name="Basis")
    keyed.shape_key_add(name="Tall").data[0].co.z = 3
    keyed.data.shape_keys.key_blocks["Tall"].value = 0.5
    keyed.vertex_groups.new(name="Some").add([0, 1], 0.5, "REPLACE")
    driver = keyed.data.shape_keys.key_blocks["Tall"].driver_add("value").driver
    driver.expression = "0.25"

    modified = _cube("Modified", (12, 0, 0), [brick])
    modified.modifiers.new("Smooth", "SUBSURF").levels = 1
    modified.modifiers.new("Off", "BEVEL").show_viewport = False
    modified.hide_render = False

    no_uvs = _cube("No UVs", (16, 0, 0), [brick])
    no_uvs.data.attributes.new("Tint", "FLOAT_COLOR", "CORNER")
    hidden = _cube("Hidden", (20, 0, 0), [brick])
    hidden.hide_viewport = hidden.hide_render = True

    _curve(context)
    _collection_instances(context, brick)
    _vertex_instances(context)
    _geometry_nodes_instances(context)
    context.view_layer.objects.active = cube
    cube.select_set(True)
    context.view_layer.update()


def _cube(name: str, location: tuple[float, ...], materials: list) -> bpy.types.Object:
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    for material in materials:
        mesh.materials.append(material)
    obj = bpy.data.objects.new(name, mesh)
    obj.location = location
    bpy.context.scene.collection.objects.link(obj)
    return obj


def _uv_layers(mesh: bpy.types.Mesh) -> None:
    """Three layers, one of them a Lightmap, with active and active_render apart."""
    for name in ("First", "Lightmap", "Third"):
        mesh.uv_layers.new(name=name)
    mesh.uv_layers["First"].active_render = True
    mesh.uv_layers.active = mesh.uv_layers["Third"]


def _textured_material(name: str) -> bpy.types.Material:
    """An image, also inside a node group, and a UV Map node, feed Principled."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    picture = bpy.data.images.new(f"{name} Picture", 4, 4)
    picture.pack()
    group = bpy.data.node_groups.new(f"{name} Group", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    inner, out = group.nodes.new("ShaderNodeTexImage"), group.nodes.new("NodeGroupOutput")
    inner.image = picture
    group.links.new(inner.outputs["Color"], out.inputs["Color"])
    nodes, links = material.node_tree.nodes, material.node_tree.links
    use = nodes.new("ShaderNodeGroup")
    use.node_tree = group
    texture, coordinates = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeTexCoord")
    texture.image = picture
    links.new(coordinates.outputs["UV"], texture.inputs["Vector"])
    links.new(use.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    links.new(texture.outputs["Alpha"], nodes["Principled BSDF"].inputs["Alpha"])
    return material


def _curve(context: bpy.types.Context) -> None:
    curve = bpy.data.curves.new("Wire", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.1
    curve.splines.new("POLY").points.add(2)
    for i, point in enumerate(curve.splines[0].points):
        point.co = (i, i * i, 0, 1)
    context.scene.collection.objects.link(bpy.data.objects.new("Wire", curve))


def _collection_instances(context: bpy.types.Context, material: bpy.types.Material) -> None:
    """A collection with an instance of another in it, turned and scaled so that it shears."""
    inner, outer = bpy.data.collections.new("Inner"), bpy.data.collections.new("Outer")
    leaf = _cube("Leaf", (0, 0, 0), [material])
    context.scene.collection.objects.unlink(leaf)
    inner.objects.link(leaf)
    nested = bpy.data.objects.new("Nested", None)
    nested.instance_type, nested.instance_collection = "COLLECTION", inner
    nested.rotation_euler = (0.3, 0.5, 0.7)
    outer.objects.link(nested)
    outer.objects.link(bpy.data.objects.new("Branch", leaf.data))
    for i, scale in enumerate(((1, 1, 1), (1, -3, 0.5))):
        instancer = bpy.data.objects.new(f"Instancer {i}", None)
        instancer.instance_type, instancer.instance_collection = "COLLECTION", outer
        instancer.matrix_world = Matrix.Translation((0, 6 * (i + 1), 0)) @ Matrix.Diagonal((*scale, 1))
        context.scene.collection.objects.link(instancer)


def _vertex_instances(context: bpy.types.Context) -> None:
    """A child shown at each vertex of its parent, which is itself shown."""
    parent = _cube("Vertex Parent", (0, -8, 0), [])
    parent.instance_type = "VERTS"
    parent.show_instancer_for_render = parent.show_instancer_for_viewport = True
    child = _cube("Vertex Child", (0, 0, 0), [])
    child.scale = (0.1, 0.1, 0.1)
    child.parent = parent


def _geometry_nodes_instances(context: bpy.types.Context) -> None:
    """Geometry nodes that show a grid's points as cubes which are no object."""
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, links = tree.nodes, tree.links
    given, result = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    scatter, shape, join = (
        nodes.new(f"GeometryNode{kind}") for kind in ("InstanceOnPoints", "MeshCube", "JoinGeometry")
    )
    shape.inputs["Size"].default_value = (0.2, 0.2, 0.2)
    links.new(given.outputs[0], scatter.inputs["Points"])
    links.new(shape.outputs["Mesh"], scatter.inputs["Instance"])
    links.new(scatter.outputs["Instances"], join.inputs[0])
    links.new(given.outputs[0], join.inputs[0])
    links.new(join.outputs[0], result.inputs[0])
    obj = _cube("Scattered", (8, -8, 0), [])
    obj.modifiers.new("Scatter", "NODES").node_group = tree
