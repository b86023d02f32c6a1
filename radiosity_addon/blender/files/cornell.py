"""The bundled scene: the Cornell box, from the data measured at Cornell University.

Geometry: Cornell University Program of Computer Graphics, "The Cornell Box" data, in its
own units, here at 1 unit = 1 cm: a room of 5.5 m. Reflectances and lamp color: the
measured spectra integrated to linear sRGB under the box's own lamp.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from ...numerics import flux_of_radiance

METERS_PER_UNIT = 0.01

REFLECTANCE = {
    "White": (0.7386, 0.7354, 0.7507),
    "Green": (0.1184, 0.3831, 0.0235),
    "Red": (0.4508, 0.0358, 0.0117),
}
LAMP_RADIANCE = (20.74, 10.86, 2.77)
"""Linear sRGB [W/m²/sr]."""
LAMP_GAP = 0.001
"""How far the lamp hangs below the ceiling [m]."""

_MIDDLE_X = 278.0  # the camera looks along this plane; it becomes Blender's X = 0
_CEILING = 548.8
_LAMP_X, _LAMP_Z = (213.0, 343.0), (227.0, 332.0)

# Corners as Cornell lists them: x to the left, y up, z into the room.
_WALLS = {
    "Floor": ("White", ((552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2))),
    "Ceiling": (
        "White",
        ((556, _CEILING, 0), (556, _CEILING, 559.2), (0, _CEILING, 559.2), (0, _CEILING, 0)),
    ),
    "Back Wall": ("White", ((549.6, 0, 559.2), (0, 0, 559.2), (0, _CEILING, 559.2), (556, _CEILING, 559.2))),
    "Right Wall": ("Green", ((0, 0, 559.2), (0, 0, 0), (0, _CEILING, 0), (0, _CEILING, 559.2))),
    "Left Wall": ("Red", ((552.8, 0, 0), (549.6, 0, 559.2), (556, _CEILING, 559.2), (556, _CEILING, 0))),
}
_BLOCKS = {  # height, and the footprint's corners (x, z)
    "Short Block": (165.0, ((130, 65), (82, 225), (240, 272), (290, 114))),
    "Tall Block": (330.0, ((423, 247), (265, 296), (314, 456), (472, 406))),
}


def build_cornell_box(scene: bpy.types.Scene | None = None) -> bpy.types.Scene:
    """Build the Cornell box, with its lamp, camera and a black world.

    Parameters
    ----------
    scene : bpy.types.Scene or None
        Where to; None takes the current scene if it is empty, else a new one that
        becomes current.

    Returns
    -------
    bpy.types.Scene
    """
    scene = scene or _scene_to_fill()
    materials = {name: _diffuse(name, color) for name, color in REFLECTANCE.items()}
    for name, (color, corners) in _WALLS.items():
        _add_mesh(scene, name, [_blender(corner) for corner in corners], [(0, 1, 2, 3)], materials[color])
    for name, (height, footprint) in _BLOCKS.items():
        vertices, faces = _block(height, footprint)
        _add_mesh(scene, name, vertices, faces, materials["White"])
    _add_lamp(scene)
    _add_camera(scene)
    scene.world = _black_world()
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    scene.view_settings.exposure = 1.5
    scene.render.resolution_x = scene.render.resolution_y = 512
    scene.render.resolution_percentage = 100
    return scene


def lamp_power() -> np.ndarray:
    """Return the lamp's power, (3,) RGB [W]: P = π A L of a one-sided diffuse emitter."""
    width, depth = _lamp_size()
    return flux_of_radiance(np.array(LAMP_RADIANCE), width * depth)


def _scene_to_fill() -> bpy.types.Scene:
    scene = bpy.context.scene
    if len(scene.objects) > 0:
        scene = bpy.data.scenes.new("Cornell Box")
        bpy.context.window.scene = scene
    else:
        scene.name = "Cornell Box"
    return scene


def _blender(corner: Sequence[float]) -> tuple[float, float, float]:
    """Turn Cornell's coordinates into Blender's meters: X right, Y into the room, Z up."""
    x, y, z = corner
    return (_MIDDLE_X - x) * METERS_PER_UNIT, z * METERS_PER_UNIT, y * METERS_PER_UNIT


def _block(height: float, footprint: Sequence[tuple[float, float]]) -> tuple[list, list]:
    """Return vertices and outward faces of a closed block that stands on the floor."""
    below = [_blender((x, 0.0, z)) for x, z in footprint]
    if _signed_area(below) < 0:
        below.reverse()  # counter-clockwise from above
    above = [(x, y, height * METERS_PER_UNIT) for x, y, _ in below]
    sides = [(i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i) for i in range(4)]
    return below + above, [(3, 2, 1, 0), (4, 5, 6, 7), *sides]


def _signed_area(corners: Sequence[Sequence[float]]) -> float:
    x, y = np.array(corners)[:, :2].T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _add_mesh(
    scene: bpy.types.Scene, name: str, vertices: list, faces: list, material: bpy.types.Material
) -> None:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material)
    mesh.update()
    scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def _diffuse(name: str, color: tuple[float, float, float]) -> bpy.types.Material:
    material = bpy.data.materials.new(f"Cornell {name}")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    material.diffuse_color = (*color, 1.0)
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*color, 1.0)
    shader.location = (-200, 0)
    tree.links.new(shader.outputs["BSDF"], output.inputs["Surface"])
    return material


def _lamp_size() -> tuple[float, float]:
    return (_LAMP_X[1] - _LAMP_X[0]) * METERS_PER_UNIT, (_LAMP_Z[1] - _LAMP_Z[0]) * METERS_PER_UNIT


def _add_lamp(scene: bpy.types.Scene) -> None:
    lamp = bpy.data.lights.new("Lamp", "AREA")
    lamp.shape = "RECTANGLE"
    lamp.size, lamp.size_y = _lamp_size()
    power = lamp_power()
    lamp.energy = power.max()
    lamp.color = power / power.max()
    obj = bpy.data.objects.new("Lamp", lamp)
    x, y, z = _blender((sum(_LAMP_X) / 2, _CEILING, sum(_LAMP_Z) / 2))
    obj.location = (x, y, z - LAMP_GAP)  # unrotated, an area lamp shines down
    scene.collection.objects.link(obj)


def _add_camera(scene: bpy.types.Scene) -> None:
    """Add Cornell's own camera: 35 mm focal length before a 25 mm film, level."""
    camera = bpy.data.cameras.new("Camera")
    camera.lens, camera.sensor_width = 35.0, 25.0
    obj = bpy.data.objects.new("Camera", camera)
    obj.location = _blender((_MIDDLE_X, 273.0, -800.0))
    obj.rotation_euler = (np.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(obj)
    scene.camera = obj


def _black_world() -> bpy.types.World:
    world = bpy.data.worlds.new("Cornell Black")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.color = (0.0, 0.0, 0.0)
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    return world
