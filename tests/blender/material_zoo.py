"""Materials of constants, one of each kind, and what makes Cycles evaluate them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from tests.blender.scenes import add_node, shader_material, with_nodes

RED = (0.6, 0.2, 0.1, 1.0)
BLUE = (0.1, 0.2, 0.8, 1.0)


def feed(material: bpy.types.Material, source: bpy.types.NodeSocket, socket: str = "Color") -> None:
    """Link a socket to that input of the material's shader."""
    tree = material.node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(source, output.inputs["Surface"].links[0].from_node.inputs[socket])


def diffuse_of(kind: str, output: str = "Color", **inputs: Any) -> tuple[bpy.types.Material, bpy.types.Node]:
    """Make a diffuse material whose color comes from a node."""
    material = shader_material(kind, "ShaderNodeBsdfDiffuse")
    node = add_node(material.node_tree, kind, **inputs)
    feed(material, node.outputs[output])
    return material, node


def _varying(tree: bpy.types.NodeTree, value: Any) -> bpy.types.NodeSocket:
    """Return a socket that is constant, but which only Cycles knows to be: a color ramp."""
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    for element in ramp.color_ramp.elements:
        element.color = value
    return ramp.outputs["Color"]


def _principled(**inputs: Any) -> Callable[[], bpy.types.Material]:
    return lambda: shader_material("M", "ShaderNodeBsdfPrincipled", **inputs)


def _mixed(kind: str) -> bpy.types.Material:
    material = shader_material("M", kind)
    tree = material.node_tree
    node = next(node for node in tree.nodes if node.bl_idname == kind)
    if kind == "ShaderNodeMixShader":
        node.inputs[0].default_value = 0.3
    sockets = [socket for socket in node.inputs if socket.type == "SHADER"]
    tree.links.new(add_node(tree, "ShaderNodeBsdfDiffuse", Color=RED).outputs[0], sockets[0])
    glow = add_node(tree, "ShaderNodeEmission", Color=BLUE, Strength=2.0)
    tree.links.new(glow.outputs[0], sockets[1])
    return material


def cut_out() -> bpy.types.Material:
    material = shader_material("M", "ShaderNodeMixShader", Fac=0.3)
    tree = material.node_tree
    mix = next(node for node in tree.nodes if node.type == "MIX_SHADER")
    tree.links.new(add_node(tree, "ShaderNodeBsdfTransparent").outputs[0], mix.inputs[1])
    tree.links.new(add_node(tree, "ShaderNodeBsdfDiffuse", Color=RED).outputs[0], mix.inputs[2])
    return material


def _bare_color() -> bpy.types.Material:
    """A color where a shader belongs: it glows."""
    material = shader_material("M", "ShaderNodeMixShader", Fac=0.3)
    tree = material.node_tree
    mix = next(node for node in tree.nodes if node.type == "MIX_SHADER")
    color = tree.nodes.new("ShaderNodeRGB")
    color.outputs[0].default_value = BLUE
    tree.links.new(color.outputs[0], mix.inputs[1])
    tree.links.new(add_node(tree, "ShaderNodeBsdfDiffuse", Color=RED).outputs[0], mix.inputs[2])
    return material


def _grouped() -> bpy.types.Material:
    """A group in a group: the inner takes a color, and mixes a shader it is given with its own."""
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    inner.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    inner.interface.new_socket("Other", in_out="INPUT", socket_type="NodeSocketShader")
    inner.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketShader")
    entry, leave = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
    own = inner.nodes.new("ShaderNodeBsdfDiffuse")
    mix = add_node(inner, "ShaderNodeMixShader", Fac=0.25)
    inner.links.new(entry.outputs["Tint"], own.inputs["Color"])
    inner.links.new(own.outputs[0], mix.inputs[1])
    inner.links.new(entry.outputs["Other"], mix.inputs[2])
    inner.links.new(mix.outputs[0], leave.inputs["Result"])

    outer = bpy.data.node_groups.new("Outer", "ShaderNodeTree")
    outer.interface.new_socket("Color", in_out="INPUT", socket_type="NodeSocketColor")
    outer.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    entry, leave = outer.nodes.new("NodeGroupInput"), outer.nodes.new("NodeGroupOutput")
    use = outer.nodes.new("ShaderNodeGroup")
    use.node_tree = inner
    glow = add_node(outer, "ShaderNodeEmission", Strength=2.0)
    outer.links.new(entry.outputs["Color"], use.inputs["Tint"])
    outer.links.new(entry.outputs["Color"], glow.inputs["Color"])
    outer.links.new(glow.outputs[0], use.inputs["Other"])
    outer.links.new(use.outputs[0], leave.inputs["Shader"])

    material = bpy.data.materials.new("M")
    tree = with_nodes(material)
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = outer
    group.inputs["Color"].default_value = RED
    tree.links.new(group.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


ZOO: dict[str, Callable[[], bpy.types.Material]] = {
    "diffuse": lambda: shader_material("M", "ShaderNodeBsdfDiffuse", Color=RED),
    "emission": lambda: shader_material("M", "ShaderNodeEmission", Color=BLUE, Strength=3.0),
    "principled": _principled(Base_Color=RED),
    "tinted": _principled(Base_Color=RED, Specular_Tint=BLUE, Specular_IOR_Level=0.9, Roughness=0.1),
    "metal": _principled(Base_Color=RED, Metallic=1.0, Roughness=0.7),
    "half a metal": _principled(Base_Color=RED, Metallic=0.4, Roughness=0.3),
    "glowing": _principled(Base_Color=RED, Emission_Color=BLUE, Emission_Strength=2.0),
    "thin": _principled(Base_Color=RED, Alpha=0.3, Emission_Color=BLUE, Emission_Strength=2.0),
    "glass": _principled(Base_Color=RED, Transmission_Weight=0.6),
    "mixed": lambda: _mixed("ShaderNodeMixShader"),
    "added": lambda: _mixed("ShaderNodeAddShader"),
    "cut out": cut_out,
    "bare color": _bare_color,
    "grouped": _grouped,
    "glossy": lambda: shader_material("M", "ShaderNodeBsdfAnisotropic", Color=RED),
}


def make_all_vary(tree: bpy.types.NodeTree) -> None:
    """Feed every unlinked color and share of the shaders with the same value from a node."""
    for node in list(tree.nodes):
        if node.type == "GROUP":
            make_all_vary(node.node_tree)
        if node.type != "GROUP" and not any(out.type == "SHADER" for out in node.outputs):
            continue
        for socket in node.inputs:
            if socket.is_linked or not socket.enabled:
                continue
            if socket.type == "RGBA":
                tree.links.new(_varying(tree, socket.default_value), socket)
            elif socket.type == "VALUE" and socket.name in (
                "Fac", "Factor", "Alpha", "Metallic", "Roughness", "Transmission Weight",
                "Specular IOR Level",
            ):  # fmt: skip
                tree.links.new(_varying(tree, [socket.default_value] * 3 + [1.0]), socket)
