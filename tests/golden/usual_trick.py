"""The usual trick for glass in Cycles: transparent to shadow and diffuse rays, of the glass's own color.

Without it Cycles lets light through glass as caustics alone, which its bakes and renders hardly find.
"""

from __future__ import annotations

import bpy

SHADERS = ("BSDF_GLASS", "BSDF_REFRACTION", "BSDF_PRINCIPLED")


def let_light_through(scene: bpy.types.Scene) -> list[str]:
    """Mix the glass of all materials of a scene with Transparent BSDFs; return the materials' names.

    Trees with a Light Path node are left alone: they have the trick.
    """
    materials = {
        slot.material for obj in scene.objects for slot in obj.material_slots if slot.material is not None
    }
    changed = []
    for material in sorted(materials, key=lambda each: each.name):
        tree = material.node_tree
        if tree is None or any(node.type == "LIGHT_PATH" for node in tree.nodes):
            continue
        glass = [node for node in tree.nodes if node.type in SHADERS and _transmits(node)]
        for node in glass:
            _mix(tree, node)
        if glass:
            changed.append(material.name)
    return changed


def _transmits(node: bpy.types.Node) -> bool:
    if node.type != "BSDF_PRINCIPLED":
        return True
    weight = node.inputs["Transmission Weight"]
    if weight.is_linked or weight.default_value not in (0.0, 1.0):
        raise ValueError(f"{node.id_data.name}: only whole glass can be mixed")
    return bool(weight.default_value)


def _mix(tree: bpy.types.NodeTree, glass: bpy.types.Node) -> None:
    targets = [link.to_socket for link in glass.outputs[0].links]
    transparent, mix = tree.nodes.new("ShaderNodeBsdfTransparent"), tree.nodes.new("ShaderNodeMixShader")
    path, either = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMath")
    either.operation = "MAXIMUM"
    tree.links.new(path.outputs["Is Shadow Ray"], either.inputs[0])
    tree.links.new(path.outputs["Is Diffuse Ray"], either.inputs[1])
    _same_color(tree, glass, transparent)
    tree.links.new(either.outputs[0], mix.inputs[0])
    tree.links.new(glass.outputs[0], mix.inputs[1])
    tree.links.new(transparent.outputs[0], mix.inputs[2])
    for target in targets:
        tree.links.new(mix.outputs[0], target)


def _same_color(tree: bpy.types.NodeTree, glass: bpy.types.Node, transparent: bpy.types.Node) -> None:
    principled = glass.type == "BSDF_PRINCIPLED"
    color = glass.inputs["Base Color" if principled else "Color"]
    # Cycles takes the root of Principled's base color at each crossing.
    power = 0.5 if principled else 1.0
    if color.is_linked:
        root = tree.nodes.new("ShaderNodeGamma")
        root.inputs["Gamma"].default_value = power
        tree.links.new(color.links[0].from_socket, root.inputs["Color"])
        tree.links.new(root.outputs["Color"], transparent.inputs["Color"])
    else:
        red, green, blue, alpha = color.default_value
        transparent.inputs["Color"].default_value = (red**power, green**power, blue**power, alpha)
