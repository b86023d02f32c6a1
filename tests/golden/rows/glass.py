"""Glass: panes and globes that light goes straight through.

Cycles' references are made with the usual trick: all glass is mixed with a Transparent BSDF of its color for
shadow and diffuse rays (`tests/golden/usual_trick.py`). One row brings materials with the trick.
"""

from __future__ import annotations

import math

import bpy

from . import row
from .materials import NOWHERE, image_node, tile_uvs
from .stage import (
    add_lamp,
    add_mesh,
    add_node,
    add_object,
    add_quad,
    diffuse,
    emptied_nodes,
    shader_material,
    stage,
)

PANE = ((-1.6, -0.9, 0.0), (1.9, -0.9, 0.0), (1.9, -0.9, 1.5), (-1.6, -0.9, 1.5))
"""A pane between the lamp at the front and most of the stage."""

TINT = (0.9, 0.55, 0.2, 1.0)


@row("glass-thin", limit=0.02)
def glass_thin() -> None:
    """Thin pane of gray glass between a lamp and the room."""
    stage()
    add_quad("Pane", PANE, NOWHERE, shader_material("Gray", "ShaderNodeBsdfGlass", Color=(0.6, 0.6, 0.6, 1)))
    _lamp()


@row("glass-closed", limit=0.02)
def glass_closed() -> None:
    """Closed pane of Principled transmission, which light crosses twice."""
    stage()
    inputs = {"Base Color": (0.3, 0.7, 0.4, 1), "Transmission Weight": 1.0, "Roughness": 0.0}
    _closed_pane(shader_material("Green", "ShaderNodeBsdfPrincipled", **inputs))
    _lamp()


@row("glass-tinted", limit=0.02)
def glass_tinted() -> None:
    """Closed pane of colored glass, and a thin one of Refraction."""
    stage()
    _closed_pane(shader_material("Amber", "ShaderNodeBsdfGlass", Color=TINT))
    blue = shader_material("Blue", "ShaderNodeBsdfRefraction", Color=(0.3, 0.5, 0.9, 1))
    corners = ((0.3, -0.2, 0.0), (1.7, -0.2, 0.0), (1.7, -0.2, 1.0), (0.3, -0.2, 1.0))
    add_quad("Screen", corners, NOWHERE, blue)
    _lamp()


@row("glass-image", limit=0.02)
def glass_image() -> None:
    """Pane of glass colored by an image, such as a church window."""
    stage(blockers=False)
    glass = shader_material("Stained", "ShaderNodeBsdfGlass")
    shader = next(node for node in glass.node_tree.nodes if node.type == "BSDF_GLASS")
    glass.node_tree.links.new(image_node(glass).outputs["Color"], shader.inputs["Color"])
    tile_uvs(add_quad("Pane", PANE, NOWHERE, glass))
    _lamp(shadow_soft_size=0.05)


@row("glass-window", limit=0.02, samples=512)
def glass_window() -> None:
    """Window in a wall: sun and sky through a closed pane."""
    stage()
    paint = diffuse("Walls", 0.5)
    # The front and the ceiling close the room; the right wall is open for a window.
    _wall("Front", ((-2, -2, 0), (-2, -2, 2.2), (2, -2, 2.2), (2, -2, 0)), paint)
    _wall("Ceiling", ((-2, -2, 2.2), (-2, 2, 2.2), (2, 2, 2.2), (2, -2, 2.2)), paint)
    for name, low, high, left, right in (
        ("Below", 0.0, 0.5, -2.0, 2.0),
        ("Above", 1.9, 2.2, -2.0, 2.0),
        ("Before", 0.5, 1.9, -2.0, -1.4),
        ("Behind", 0.5, 1.9, 1.2, 2.0),
    ):
        _wall(name, ((2, left, low), (2, left, high), (2, right, high), (2, right, low)), paint)
    glass = shader_material("Window", "ShaderNodeBsdfGlass", Color=(0.85, 0.9, 0.88, 1))
    _box("Pane", (2.01, -1.4, 0.5), (2.03, 1.2, 1.9), glass)
    add_lamp("SUN", location=(6, -1.5, 5.2), target=(0, 0.2, 0.3), energy=3, angle=math.radians(2))
    # For Cycles alone, or its noise would be larger than what is compared.
    portal = add_lamp("AREA", location=(2.06, -0.1, 1.2), target=(0, -0.1, 1.2), shape="RECTANGLE")
    portal.data.size, portal.data.size_y, portal.data.cycles.is_portal = 2.7, 1.5, True
    world = bpy.data.worlds.new("Sky")
    tree = emptied_nodes(world)
    background = add_node(tree, "ShaderNodeBackground", Color=(0.4, 0.6, 1.0, 1), Strength=1.0)
    tree.links.new(background.outputs[0], tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    bpy.context.scene.world = world


@row("glass-globe", limit=0.02)
def glass_globe() -> None:
    """Lamp in a globe of frosted glass with two walls."""
    stage()
    glass = shader_material("Globe", "ShaderNodeBsdfGlass", Color=(0.95, 0.8, 0.6, 1), Roughness=0.3)
    for name, radius in (("Outer", 0.25), ("Inner", 0.23)):
        _sphere(name, (1.0, -0.6, 1.6), radius, glass)
    add_lamp("POINT", location=(1.0, -0.6, 1.6), energy=100, shadow_soft_size=0.05)


@row("glass-light-path", limit=0.02)
def glass_light_path() -> None:
    """Glass that a Light Path node makes transparent for shadow and diffuse rays."""
    stage()
    glass = shader_material("Pane", "ShaderNodeMixShader")
    tree = glass.node_tree
    mix = next(node for node in tree.nodes if node.type == "MIX_SHADER")
    path, either = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMath")
    either.operation = "MAXIMUM"
    tree.links.new(path.outputs["Is Shadow Ray"], either.inputs[0])
    tree.links.new(path.outputs["Is Diffuse Ray"], either.inputs[1])
    tree.links.new(either.outputs[0], mix.inputs[0])
    tree.links.new(add_node(tree, "ShaderNodeBsdfGlass", Color=TINT).outputs[0], mix.inputs[1])
    tree.links.new(add_node(tree, "ShaderNodeBsdfTransparent", Color=TINT).outputs[0], mix.inputs[2])
    _closed_pane(glass)
    _lamp()


def _lamp(**settings: float) -> None:
    add_lamp("POINT", location=(0.6, -1.9, 1.3), **{"energy": 100, "shadow_soft_size": 0.1, **settings})


def _closed_pane(material: bpy.types.Material) -> None:
    (left, front, low), *_ = PANE
    right, _, high = PANE[2]
    _box("Pane", (left, front, low + 0.01), (right, front + 0.03, high), material)


def _wall(name: str, corners: tuple[tuple[float, float, float], ...], material: bpy.types.Material) -> None:
    """Add a quad that gets no lightmap."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], ((0, 1, 2, 3),))
    mesh.materials.append(material)
    add_object(name, mesh)


def _box(
    name: str,
    low: tuple[float, float, float],
    high: tuple[float, float, float],
    material: bpy.types.Material,
) -> None:
    """Add a box along the axes without a place in the lightmap."""
    ends = tuple(zip(low, high, strict=True))
    vertices = [(x, y, z) for z in ends[2] for y in ends[1] for x in ends[0]]
    faces = ((0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6), (4, 5, 7, 6), (2, 3, 1, 0))
    add_mesh(name, vertices, faces, _nowhere(4) * 6, material)


def _sphere(
    name: str, middle: tuple[float, float, float], radius: float, material: bpy.types.Material
) -> None:
    """Add a sphere of quads and triangles without a place in the lightmap."""
    rings, segments = 8, 16
    vertices = [(0.0, 0.0, radius)]
    for ring in range(1, rings):
        down = math.pi * ring / rings
        for segment in range(segments):
            around = 2 * math.pi * segment / segments
            across = radius * math.sin(down)
            vertices.append((across * math.cos(around), across * math.sin(around), radius * math.cos(down)))
    vertices.append((0.0, 0.0, -radius))
    first, last = 0, len(vertices) - 1
    faces: list[tuple[int, ...]] = []
    for segment in range(segments):
        following = (segment + 1) % segments
        faces.append((first, 1 + segment, 1 + following))
        for ring in range(rings - 2):
            upper, lower = 1 + ring * segments, 1 + (ring + 1) * segments
            faces.append((upper + segment, lower + segment, lower + following, upper + following))
        below = 1 + (rings - 2) * segments
        faces.append((below + segment, last, below + following))
    texels = [corner for face in faces for corner in _nowhere(len(face))]
    add_mesh(name, vertices, faces, texels, material).location = middle


def _nowhere(corners: int) -> list[tuple[float, float]]:
    """Return places in the lightmap of a face's corners, without a texel's center among them."""
    left, bottom, right, top = NOWHERE
    return [(left, bottom), (right, bottom), (right, top), (left, top)][:corners]
