"""Random materials, lamps and worlds."""

from __future__ import annotations

import contextlib
import math
from random import Random

import bpy

SHADERS = (
    *("BsdfDiffuse", "BsdfDiffuse", "BsdfPrincipled", "BsdfPrincipled", "Emission", "BsdfTransparent"),
    *("BsdfTranslucent", "BsdfGlass", "BsdfGlossy", "BsdfAnisotropic", "SubsurfaceScattering", "BsdfSheen"),
    *(
        "BsdfRefraction",
        "Holdout",
        "MixShader",
        "MixShader",
        "MixShader",
        "AddShader",
        "AddShader",
        "Background",
    ),
)
OTHERS = (
    *(
        "TexNoise",
        "TexChecker",
        "TexImage",
        "TexVoronoi",
        "TexGradient",
        "TexCoord",
        "Mapping",
        "RGB",
        "Value",
        "Math",
    ),
    *(
        "Mix",
        "MixRGB",
        "Invert",
        "HueSaturation",
        "ValToRGB",
        "LightPath",
        "NewGeometry",
        "Fresnel",
        "LayerWeight",
    ),
    *(
        "ObjectInfo",
        "Attribute",
        "VertexColor",
        "UVMap",
        "Bump",
        "NormalMap",
        "BrightContrast",
        "Gamma",
        "Clamp",
    ),
    *("MapRange", "CombineXYZ", "SeparateXYZ", "Blackbody", "RGBToBW", "ShaderToRGB", "AmbientOcclusion"),
)
NAMES = (
    "Wand",
    "壁",
    "Ünïcödé",
    "a/b",
    "..",
    "preview",
    "lightmap",
    "report.json",
    "con",
    "x" * 63,
    " ",
    "Wall.001",
)
"""Names that file systems, JSON or a careless program may stumble over."""


def name(random: Random, plain: str) -> str:
    return random.choice(NAMES) if random.random() < 0.12 else plain


def color(random: Random, most: float = 0.9) -> tuple[float, float, float, float]:
    return (*(random.uniform(0, most) for _ in range(3)), 1.0)


def plain_material(random: Random, title: str) -> bpy.types.Material:
    """One shader with a color of its own, such as users edit most."""
    made, tree = _material(title)
    shader = tree.nodes.new(random.choice(("ShaderNodeBsdfPrincipled", "ShaderNodeBsdfDiffuse")))
    shader.inputs[0].default_value = color(random)
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def emitter(title: str, strength: float) -> bpy.types.Material:
    made, tree = _material(title)
    shader = tree.nodes.new("ShaderNodeEmission")
    shader.inputs["Strength"].default_value = strength
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def wild_material(random: Random, title: str) -> bpy.types.Material:
    """Random nodes, randomly linked, some muted, now and then in a group."""
    made, tree = _material(title)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    _random_nodes(random, tree)
    shaders = [socket for node in tree.nodes for socket in node.outputs if socket.type == "SHADER"]
    if shaders and random.random() < 0.95:
        tree.links.new(random.choice(shaders), output.inputs["Surface"])
    if random.random() < 0.1:
        made.use_backface_culling = True
    if random.random() < 0.1 and hasattr(made, "use_transparent_shadow"):
        made.use_transparent_shadow = False
    if random.random() < 0.1:
        made.radiosity_light_group = random.choice(("Küche", "A", "B"))
    return made


def _material(title: str) -> tuple[bpy.types.Material, bpy.types.NodeTree]:
    made = bpy.data.materials.new(title)
    return made, emptied(made)


def emptied(owner: bpy.types.ID) -> bpy.types.NodeTree:
    """Return the owner's node tree without its nodes."""
    if owner.node_tree is None or bpy.app.version < (5, 0):
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


def _random_nodes(random: Random, tree: bpy.types.NodeTree) -> None:
    nodes = []
    for _ in range(random.randint(2, 8)):
        kind = random.choice(SHADERS if random.random() < 0.6 else OTHERS)
        with contextlib.suppress(RuntimeError):  # not every version has every node
            nodes.append(tree.nodes.new(f"ShaderNode{kind}"))
    for node in nodes:
        node.mute = random.random() < 0.12
        if node.type == "TEX_IMAGE" and random.random() < 0.8:
            node.image = picture(random)
        for socket in node.inputs:
            with contextlib.suppress(AttributeError, TypeError, ValueError):
                if socket.type == "RGBA":
                    socket.default_value = color(random, random.choice((0.9, 0.9, 1.0, 5.0)))
                elif socket.type == "VALUE" and random.random() < 0.5:
                    socket.default_value = random.choice((0.0, 0.3, 1.0, random.uniform(-1, 20)))
    for node in nodes:
        for socket in node.inputs:
            if random.random() < (0.9 if socket.type == "SHADER" else 0.25):
                source = random.choice(nodes)
                kind = socket.type == "SHADER"
                outputs = [each for each in source.outputs if (each.type == "SHADER") == kind]
                if outputs and source != node:
                    tree.links.new(random.choice(outputs), socket)


def picture(random: Random) -> bpy.types.Image:
    """Make an image with or without pixels of its own; some are of a file that is not there."""
    if random.random() < 0.1:
        made = bpy.data.images.new("lost", 4, 4)
        made.source, made.filepath_raw = "FILE", "//lost.png"
        return made
    made = bpy.data.images.new(name(random, "picture"), 8, 8, float_buffer=random.random() < 0.3)
    made.pixels.foreach_set([random.random() for _ in range(256)])
    made.pack()
    return made


def lamp(random: Random) -> bpy.types.Light:
    kind = random.choice(("POINT", "SPOT", "SUN", "AREA"))
    made = bpy.data.lights.new(name(random, kind.title()), kind)
    made.color = color(random, 1.0)[:3]
    made.energy = (
        random.choice((0.0, 1.0, 100.0, 1e5, -10.0)) if kind != "SUN" else random.choice((0.0, 1.0, 4.0))
    )
    made.use_shadow = random.random() < 0.9
    if kind == "AREA":
        made.shape = random.choice(("SQUARE", "RECTANGLE", "DISK", "ELLIPSE"))
        made.size, made.size_y = random.choice((0.0, 1e-3, 1.0, 5.0)), random.choice((1e-3, 1.0))
        made.spread = random.choice((math.pi, 1.0, 0.01))
    elif kind == "SUN":
        made.angle = random.choice((0.0, 0.01, 3.0))
    else:
        made.shadow_soft_size = random.choice((0.0, 0.1, 2.0))
    if kind == "SPOT":
        made.spot_size, made.spot_blend = random.uniform(0.02, 3.1), random.random()
    return made


def world(random: Random) -> bpy.types.World | None:
    """Make a world of one color, of a texture, now and then a sky."""
    kind = random.choice(("none", "none", "color", "color", "checker", "empty"))
    if kind == "none":
        return None
    made = bpy.data.worlds.new(name(random, "World"))
    tree = emptied(made)
    if kind == "empty":
        return made
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = color(random, 1.0)
    background.inputs["Strength"].default_value = random.choice((0.0, 0.5, 3.0))
    if kind == "checker":
        texture = tree.nodes.new("ShaderNodeTexSky" if random.random() < 0.08 else "ShaderNodeTexChecker")
        tree.links.new(texture.outputs[0], background.inputs["Color"])
    tree.links.new(background.outputs[0], tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    return made
