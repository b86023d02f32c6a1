"""Muted nodes and links: the bake reads, and the lightmap shows, what Cycles renders of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.materials.materials import read_material
from radiosity_addon.numerics.radiometry import radiance_of_radiosity
from tests.blender.hand_bake import add_plane, bake_by_hand, seen_from_above
from tests.blender.scenes import add_node, set_world, with_nodes

pytestmark = pytest.mark.usefixtures("record")

RED, BLUE, GREEN = (0.6, 0.2, 0.1, 1.0), (0.1, 0.2, 0.8, 1.0), (0.1, 0.7, 0.3, 1.0)

Tree = bpy.types.NodeTree
Socket = bpy.types.NodeSocket


def diffuse(tree: Tree) -> Socket:
    return add_node(tree, "ShaderNodeBsdfDiffuse", Color=RED).outputs[0]


def glow(tree: Tree) -> Socket:
    return add_node(tree, "ShaderNodeEmission", Color=BLUE, Strength=2.0).outputs[0]


def matte(tree: Tree) -> bpy.types.Node:
    node = add_node(tree, "ShaderNodeBsdfPrincipled", Roughness=1.0)
    node.inputs["Specular IOR Level"].default_value = 0.0
    node.inputs["Base Color"].default_value = GREEN
    node.inputs["Emission Color"].default_value = BLUE
    node.inputs["Emission Strength"].default_value = 0.5
    return node


def muted(node: bpy.types.Node) -> bpy.types.Node:
    node.mute = True
    return node


def mix(tree: Tree, first: bool = True, second: bool = True, factor: bool = False) -> Socket:
    node = muted(add_node(tree, "ShaderNodeMixShader"))
    if factor:
        tree.links.new(add_node(tree, "ShaderNodeValue").outputs[0], node.inputs[0])
    if first:
        tree.links.new(diffuse(tree), node.inputs[1])
    if second:
        tree.links.new(glow(tree), node.inputs[2])
    return node.outputs[0]


def add(tree: Tree, first: bool = True) -> Socket:
    node = muted(add_node(tree, "ShaderNodeAddShader"))
    if first:
        tree.links.new(diffuse(tree), node.inputs[0])
    tree.links.new(glow(tree), node.inputs[1])
    return node.outputs[0]


def nested(tree: Tree) -> Socket:
    """A mix that counts, of a muted add and of a muted emission."""
    node = add_node(tree, "ShaderNodeMixShader", Fac=0.25)
    tree.links.new(add(tree), node.inputs[1])
    tree.links.new(muted(glow(tree).node).outputs[0], node.inputs[2])
    return node.outputs[0]


def reroutes(tree: Tree) -> Socket:
    one, other = tree.nodes.new("NodeReroute"), tree.nodes.new("NodeReroute")
    tree.links.new(mix(tree), one.inputs[0])
    tree.links.new(one.outputs[0], other.inputs[0])
    return other.outputs[0]


def muted_reroute(tree: Tree) -> Socket:
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(diffuse(tree), reroute.inputs[0])
    return muted(reroute).outputs[0]


def empty_reroute(tree: Tree) -> Socket:
    node = matte(tree)
    tree.links.new(tree.nodes.new("NodeReroute").outputs[0], node.inputs["Base Color"])
    return node.outputs[0]


def muted_principled(tree: Tree) -> Socket:
    node = matte(tree)
    tree.links.new(add_node(tree, "ShaderNodeRGB").outputs[0], node.inputs["Base Color"])
    return muted(node).outputs[0]


def colored(make: Callable[[Tree], Socket]) -> Callable[[Tree], Socket]:
    """A Principled BSDF whose base color and emission come from a node's output."""

    def build(tree: Tree) -> Socket:
        node = matte(tree)
        source = make(tree)
        tree.links.new(source, node.inputs["Base Color"])
        tree.links.new(source, node.inputs["Emission Color"])
        return node.outputs[0]

    return build


def texture(tree: Tree) -> Socket:
    return muted(tree.nodes.new("ShaderNodeTexNoise")).outputs["Color"]


def rgb(tree: Tree) -> Socket:
    return muted(add_node(tree, "ShaderNodeRGB")).outputs[0]


def hue(tree: Tree, linked: bool = True) -> Socket:
    node = add_node(tree, "ShaderNodeHueSaturation", Hue=0.1, Value=0.5, Color=RED)
    if linked:
        source = add_node(tree, "ShaderNodeRGB")
        source.outputs[0].default_value = BLUE
        tree.links.new(source.outputs[0], node.inputs["Color"])
    return muted(node).outputs[0]


def color_mix(tree: Tree) -> Socket:
    node = add_node(tree, "ShaderNodeMix")
    node.data_type = "RGBA"
    sockets = {socket.identifier: socket for socket in node.inputs}
    sockets["A_Color"].default_value, sockets["B_Color"].default_value = RED, BLUE
    source = add_node(tree, "ShaderNodeRGB")
    source.outputs[0].default_value = GREEN
    tree.links.new(source.outputs[0], sockets["B_Color"])
    return next(out for out in muted(node).outputs if out.identifier == "Result_Color")


def group_tree(inner_mute: bool = False) -> Tree:
    """A group that mixes the shader it is given with a glow, and puts that and its tint out."""
    group = bpy.data.node_groups.new("Wrapped", "ShaderNodeTree")
    for name, kind in (("Tint", "Color"), ("Shader", "Shader")):
        group.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
        group.interface.new_socket(name, in_out="OUTPUT", socket_type=f"NodeSocket{kind}")
    entry, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    node = add_node(group, "ShaderNodeMixShader", Fac=0.5)
    group.links.new(entry.outputs["Shader"], node.inputs[1])
    group.links.new(glow(group), node.inputs[2])
    group.links.new(node.outputs[0], leave.inputs["Shader"])
    group.links.new(entry.outputs["Tint"], leave.inputs["Tint"])
    node.mute = inner_mute
    return group


def grouped(given: bool, mute: bool, inner_mute: bool) -> Callable[[Tree], Socket]:
    def build(tree: Tree) -> Socket:
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group_tree(inner_mute)
        if given:
            tree.links.new(diffuse(tree), node.inputs["Shader"])
        node.mute = mute
        return node.outputs["Shader"]

    return build


def tinted(tree: Tree) -> Socket:
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group_tree()
    node.inputs["Tint"].default_value = RED
    return muted(node).outputs["Tint"]


def cut(tree: Tree) -> Socket:
    """A mix whose second link is muted."""
    node = add_node(tree, "ShaderNodeMixShader", Fac=0.5)
    tree.links.new(diffuse(tree), node.inputs[1])
    tree.links.new(glow(tree), node.inputs[2]).is_muted = True
    return node.outputs[0]


def cut_before_mute(tree: Tree) -> Socket:
    node = muted(add_node(tree, "ShaderNodeMixShader"))
    tree.links.new(diffuse(tree), node.inputs[1]).is_muted = True
    tree.links.new(glow(tree), node.inputs[2])
    return node.outputs[0]


DIFFERENT_BEFORE_5 = {"empty reroute", "unlinked hue into color", "group into color"}
"""Nodes that lead to nothing: versions before 5.0 do not take the value of the socket that reads them."""

CASES: dict[str, Callable[[Tree], Socket]] = {
    "mix": mix,
    "mix, factor linked": lambda tree: mix(tree, factor=True),
    "mix, first alone": lambda tree: mix(tree, second=False),
    "mix, second alone": lambda tree: mix(tree, first=False),
    "mix, nothing": lambda tree: mix(tree, first=False, second=False),
    "add": add,
    "add, second alone": lambda tree: add(tree, first=False),
    "nested": nested,
    "reroutes": reroutes,
    "muted reroute": muted_reroute,
    "empty reroute": empty_reroute,
    "principled": muted_principled,
    "diffuse": lambda tree: muted(diffuse(tree).node).outputs[0],
    "emission": lambda tree: muted(glow(tree).node).outputs[0],
    "transparent": lambda tree: muted(add_node(tree, "ShaderNodeBsdfTransparent")).outputs[0],
    "texture into color": colored(texture),
    "rgb into color": colored(rgb),
    "hue into color": colored(hue),
    "unlinked hue into color": colored(lambda tree: hue(tree, linked=False)),
    "color mix": colored(color_mix),
    "group": grouped(given=True, mute=True, inner_mute=False),
    "group, nothing given": grouped(given=False, mute=True, inner_mute=False),
    "inside a group": grouped(given=True, mute=False, inner_mute=True),
    "inside a group, nothing given": grouped(given=False, mute=False, inner_mute=True),
    "group into color": colored(tinted),
    "muted link": cut,
    "muted link before a muted node": cut_before_mute,
}


@pytest.mark.parametrize("case", CASES)
def test_bake_and_picture_agree_with_cycles(case: str, tmp_path: Path) -> None:
    """Under a sky of radiance 1 a square shows reflectance + emission; so it does with a lightmap of 1."""
    if bpy.app.version < (5, 0) and case in DIFFERENT_BEFORE_5:
        pytest.skip("earlier versions of Cycles read the value of the last socket instead")
    material = bpy.data.materials.new("Case")
    tree = with_nodes(material)
    tree.links.new(CASES[case](tree), tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    add_plane(material=material)
    set_world(1.0, 1.0, 1.0)
    bpy.context.scene.world.cycles.sampling_method = "NONE"
    rendered = seen_from_above(tmp_path)[0, 0]
    surface = read_material(material)
    assert surface.opacity == 1.0
    read = surface.reflectance + radiance_of_radiosity(surface.emission)
    bake_by_hand(((1.0, 1.0, 1.0),))
    shown = seen_from_above(tmp_path)[0, 0]
    restore(bpy.context)
    np.testing.assert_allclose([read, shown], [rendered, rendered], rtol=2e-3, atol=1e-4)
