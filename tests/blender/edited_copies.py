"""Materials to edit where they show lightmaps, and the sockets at which one edits them."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from radiosity_addon.blender.datablocks.bake_record import ORIGINAL, is_made
from radiosity_addon.blender.material_copies.copy_marks import behind_ours
from radiosity_addon.blender.material_edits.stripping import is_lightmap_node
from tests.blender.hand_bake import (
    BASE,
    add_plane,
    add_shader,
    bake_by_hand,
    link_surface,
    principled_material,
)
from tests.blender.material_zoo import ZOO
from tests.blender.scenes import add_node, with_nodes

GREEN = (0.1, 0.7, 0.3, 1.0)
Material = bpy.types.Material


def copy_of(material: Material | None) -> Material:
    (copy,) = (m for m in bpy.data.materials if is_made(m) and m.get(ORIGINAL) == material)
    return copy


def shader(material: Material, kind: str = "BSDF_PRINCIPLED") -> bpy.types.Node:
    return next(node for node in material.node_tree.nodes if node.type == kind)


def lightmap_node(copy: Material) -> bpy.types.Node:
    (node,) = (node for node in copy.node_tree.nodes if is_lightmap_node(node))
    return node


def constant_of(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """What the panel and the node editor show as an input's constant on a copy: a node's output."""
    return behind_ours(socket).links[0].from_socket


def color_node(copy: Material) -> bpy.types.NodeSocket:
    """The node that the panel and the node editor show as Base Color."""
    return constant_of(shader(copy).inputs["Base Color"])


def base_color(material: Material) -> tuple[float, ...]:
    return tuple(shader(material).inputs["Base Color"].default_value)


def add_texture(material: Material) -> bpy.types.Node:
    """Feed the base color with a picture of one color."""
    image = bpy.data.images.new("Bricks", 2, 2, float_buffer=True, is_data=True)
    image.pixels[:] = [0.25, 0.5, 0.125, 1.0] * 4
    image.pack()
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(node.outputs["Color"], shader(material).inputs["Base Color"])
    return node


def grouped_material() -> tuple[Material, bpy.types.NodeTree]:
    group = bpy.data.node_groups.new("Wrapped", "ShaderNodeTree")
    group.interface.new_socket("Rough", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    entry, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    diffuse = add_node(group, "ShaderNodeBsdfDiffuse", Color=(*BASE, 1.0))
    group.links.new(entry.outputs["Rough"], diffuse.inputs["Roughness"])
    group.links.new(diffuse.outputs[0], leave.inputs["Shader"])
    material = bpy.data.materials.new("Grouped")
    tree = with_nodes(material)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.links.new(node.outputs["Shader"], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material, group


def two_copies() -> tuple[Material, Material, Material]:
    """One material on two pages."""
    material = principled_material()
    for name in ("One", "Two"):
        add_plane(name, material)
    bake_by_hand(((0.1, 0.1, 0.1), (0.2, 0.2, 0.2)))
    copies = [bpy.data.objects[name].material_slots[0].material for name in ("One", "Two")]
    assert copies[0] != copies[1]
    return (material, *copies)


def odd_materials() -> dict[str, Callable[[], Material]]:
    """Materials on which the lightmap's nodes are wired in unusual ways."""

    def two_outputs() -> Material:
        material = principled_material()
        tree = material.node_tree
        other = tree.nodes.new("ShaderNodeOutputMaterial")
        other.target = "EEVEE"
        tree.links.new(add_shader(material, "Emission", Strength=3.0).outputs[0], other.inputs["Surface"])
        return material

    def muted_link() -> Material:
        material = principled_material()
        shader(material).outputs[0].links[0].is_muted = True
        return material

    def coordinates() -> Material:
        material = principled_material()
        texture, source = add_texture(material), material.node_tree.nodes.new("ShaderNodeTexCoord")
        material.node_tree.links.new(source.outputs["UV"], texture.inputs["Vector"]).is_muted = True
        add_texture(material)
        return material

    def keyed() -> Material:
        material = principled_material(Emission_Strength=2.0)
        node = shader(material)
        node.inputs["Emission Strength"].keyframe_insert("default_value", frame=1)
        node.inputs["Base Color"].driver_add("default_value", 0).driver.expression = "0.5"
        return material

    def no_output() -> Material:
        material = bpy.data.materials.new("Empty")
        with_nodes(material)
        return material

    def see_through() -> Material:
        return principled_material(Alpha=0.25, Emission_Strength=3.0)

    def shared_color() -> Material:
        material = principled_material()
        tree = material.node_tree
        color = tree.nodes.new("ShaderNodeRGB")
        for name in ("Base Color", "Emission Color", "Specular Tint"):
            tree.links.new(color.outputs[0], shader(material).inputs[name])
        return material

    def muted_color() -> Material:
        material = principled_material()
        add_texture(material).outputs["Color"].links[0].is_muted = True
        return material

    def metal_map() -> Material:
        """Base color by a reroute, metal and roughness by a picture."""
        material = principled_material(Coat_Weight=0.5)
        tree, inputs = material.node_tree, shader(material).inputs
        texture, reroute = add_texture(material), tree.nodes.new("NodeReroute")
        tree.links.new(texture.outputs["Color"], reroute.inputs[0])
        tree.links.new(reroute.outputs[0], inputs["Base Color"])
        for name in ("Metallic", "Roughness", "Transmission Weight"):
            tree.links.new(texture.outputs["Alpha"], inputs[name])
        inputs["Coat Weight"].keyframe_insert("default_value", frame=1)
        return material

    def one_shader_twice() -> Material:
        """Mixed with itself, and under both outputs."""
        material = principled_material()
        tree, mix = material.node_tree, add_shader(material, "MixShader", Fac=0.25)
        other = tree.nodes.new("ShaderNodeOutputMaterial")
        other.target = "EEVEE"
        for socket in (*mix.inputs[1:], other.inputs["Surface"]):
            tree.links.new(shader(material).outputs[0], socket)
        link_surface(material, mix.outputs[0])
        return material

    def one_group_twice() -> Material:
        material, group = grouped_material()
        tree, mix = material.node_tree, add_shader(material, "MixShader", Fac=0.25)
        second = tree.nodes.new("ShaderNodeGroup")
        second.node_tree = group
        for node, socket in zip((shader(material, "GROUP"), second), mix.inputs[1:], strict=True):
            tree.links.new(node.outputs[0], socket)
        output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
        tree.links.new(mix.outputs[0], output.inputs["Surface"])
        return material

    def color_at_the_output() -> Material:
        material = principled_material()
        link_surface(material, add_texture(material).outputs["Color"])
        return material

    def muted_shader() -> Material:
        """Of a muted mix the first shader counts."""
        material = principled_material()
        mix = add_shader(material, "MixShader")
        material.node_tree.links.new(shader(material).outputs[0], mix.inputs[1])
        material.node_tree.links.new(add_shader(material, "BsdfDiffuse").outputs[0], mix.inputs[2])
        link_surface(material, mix.outputs[0])
        mix.mute = True
        return material

    return {
        "muted color": muted_color,
        "metal map": metal_map,
        "one shader twice": one_shader_twice,
        "one group twice": one_group_twice,
        "color at the output": color_at_the_output,
        "muted shader": muted_shader,
        "two outputs": two_outputs,
        "muted link": muted_link,
        "coordinates": coordinates,
        "keyed": keyed,
        "no output": no_output,
        "see-through": see_through,
        "shared color": shared_color,
        "group": lambda: grouped_material()[0],
    }


EVERY = {**ZOO, **odd_materials()}
