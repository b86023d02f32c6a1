"""Materials, lamps and worlds of every sort, drawn by a random generator."""

from __future__ import annotations

from random import Random

import bpy

from tests.blender.scenes import add_node, set_world, shader_material


def color(random: Random, brightest: float = 0.9) -> tuple[float, float, float, float]:
    return (*(random.uniform(0, brightest) for _ in range(3)), 1.0)


def material(random: Random) -> bpy.types.Material | None:
    """Make a material; None stands for an empty slot."""
    kind = random.choice(
        ("diffuse", "diffuse", "principled", "principled", "emission", "mix", "image", "none")
    )
    if kind == "none":
        return None
    if kind == "diffuse":
        return shader_material(kind, "ShaderNodeBsdfDiffuse", Color=color(random))
    if kind == "emission":
        strength = random.choice((0.0, 1.0, 30.0))
        return shader_material(kind, "ShaderNodeEmission", Color=color(random, 1.0), Strength=strength)
    made = shader_material(
        kind,
        "ShaderNodeBsdfPrincipled",
        **{"Base Color": color(random), "Metallic": random.choice((0.0, 0.0, 1.0))},
        Alpha=random.choice((1.0, 1.0, 0.5)),
    )
    tree = made.node_tree
    surface, output = tree.nodes["Principled BSDF"], tree.nodes["Material Output"]
    if kind == "mix":
        mix = add_node(tree, random.choice(("ShaderNodeMixShader", "ShaderNodeAddShader")))
        other = random.choice(("ShaderNodeBsdfDiffuse", "ShaderNodeBsdfTransparent", "ShaderNodeEmission"))
        shaders = [socket for socket in mix.inputs if socket.type == "SHADER"]
        tree.links.new(surface.outputs[0], shaders[0])
        tree.links.new(add_node(tree, other, Color=color(random)).outputs[0], shaders[1])
        tree.links.new(mix.outputs[0], output.inputs["Surface"])
    elif kind == "image":
        texture = tree.nodes.new(random.choice(("ShaderNodeTexImage", "ShaderNodeTexChecker")))
        if texture.type == "TEX_IMAGE" and random.random() < 0.8:
            texture.image = bpy.data.images.new("Picture", 4, 4)
            texture.image.pixels.foreach_set([random.random() for _ in range(64)])
            texture.image.pack()
        tree.links.new(texture.outputs["Color"], surface.inputs["Base Color"])
    return made


def lamp(random: Random) -> bpy.types.Light:
    kind = random.choice(("POINT", "SPOT", "SUN", "AREA"))
    made = bpy.data.lights.new(kind.title(), kind)
    made.color = color(random, 1.0)[:3]
    made.energy = random.choice((0.0, 1.0, 5.0)) if kind == "SUN" else random.choice((0.0, 10.0, 1000.0))
    made.use_shadow = random.random() < 0.9
    if kind == "SUN":
        made.angle = random.choice((0.0, 0.1, 3.0))
    elif kind == "AREA":
        made.shape = random.choice(("SQUARE", "RECTANGLE", "DISK", "ELLIPSE"))
        made.size, made.size_y = random.uniform(0.01, 3), random.uniform(0.01, 3)
        made.spread = random.choice((3.14159, 1.0))
    else:
        made.shadow_soft_size = random.choice((0.0, 0.1, 1.0))
    if kind == "SPOT":
        made.spot_size, made.spot_blend = random.uniform(0.05, 3.1), random.random()
    return made


def world(random: Random) -> None:
    """Give the scene no world, a color, or a sky of one."""
    kind = random.choice(("none", "none", "color", "texture"))
    if kind == "none":
        return
    made = set_world(*color(random, 1.0)[:3], strength=random.choice((0.0, 1.0, 3.0)))
    if kind == "texture":
        tree = made.node_tree
        texture = tree.nodes.new("ShaderNodeTexChecker")
        tree.links.new(texture.outputs["Color"], tree.nodes["Background"].inputs["Color"])
