"""Scenes of many triangles: the office with all its meshes subdivided, and foliage of cut-out cards.

python -m bench.interior.dense office 1400000 office.blend
python -m bench.interior.dense foliage 500000 foliage.blend
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

import bpy
import numpy as np

from radiosity_addon.blender.files.files import empty_scene

from ..layout import lay_out, write_layout
from .office import GLOWS, build_office

SUN = (np.radians(52), 0.0, np.radians(15))
"""Its rotation: it shines in through the windows."""

PLAIN, FINEST = 2, 4
"""Levels of subdivision: each makes four faces of one. Objects get the second in turn until the number of
triangles is reached."""

TEXTURE, TILE = 256, 1.5
"""Pixels of an image's side, and what it covers [m]."""

CARD, FOREST = 0.25, 18.0
"""Sides of a card and of the ground that cards stand on [m]."""


def build_dense_office(triangles: int, resolution: int = 0) -> bpy.types.Scene:
    """Fill the empty open file with the office: its meshes subdivided and textured, sun and sky outside.

    resolution: Of the page on which the plain office is laid out, for bakes that keep UVs; 0 leaves that to
        the bake.
    """
    scene = build_office()
    for lamp in [obj for obj in scene.objects if obj.type == "LIGHT"]:
        bpy.data.objects.remove(lamp)
    _add_sun(scene)
    objects = [obj for obj in scene.objects if obj.type == "MESH"]
    for obj in objects:
        _project_uvs(obj.data)
    if resolution:
        write_layout(lay_out(resolution))
    levels = _levels([_quads_and_triangles(obj.data) for obj in objects], triangles)
    for obj, level in zip(objects, levels, strict=True):
        modifier = obj.modifiers.new("Subdivision", "SUBSURF")
        modifier.subdivision_type, modifier.levels = "SIMPLE", level
        modifier.render_levels = level
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for obj in objects:
        mesh = bpy.data.meshes.new_from_object(obj.evaluated_get(depsgraph))
        obj.modifiers.clear()
        obj.data = mesh
    for material in bpy.data.materials:
        if material.name not in GLOWS:
            _give_image(material)
    return scene


def build_foliage(triangles: int) -> bpy.types.Scene:
    """Fill the empty open file with cards that an image's alpha cuts out, under sun and sky."""
    random = np.random.default_rng(7)
    scene = bpy.context.scene
    count = triangles // 2
    square = np.array([(-1, 0, 0), (1, 0, 0), (1, 0, 2), (-1, 0, 2)]) * 0.5 * CARD
    turn, lean = random.uniform(0, 2 * np.pi, count), random.normal(0, 0.5, count)
    leaning = np.stack(
        [
            np.broadcast_to(square[:, 0], (count, 4)),
            -np.sin(lean)[:, None] * square[:, 2],
            np.cos(lean)[:, None] * square[:, 2],
        ],
        axis=2,
    )
    x, y = leaning[..., 0].copy(), leaning[..., 1].copy()
    leaning[..., 0] = np.cos(turn)[:, None] * x - np.sin(turn)[:, None] * y
    leaning[..., 1] = np.sin(turn)[:, None] * x + np.cos(turn)[:, None] * y
    across, height = random.uniform(-0.5, 0.5, (count, 2)) * FOREST, random.gamma(2.0, 0.6, (count, 1))
    place = np.append(across, height, axis=1)
    vertices = (leaning + place[:, None]).reshape(-1, 3)
    leaf = _mesh("Leaves", vertices, np.arange(4 * count).reshape(-1, 4))
    leaf.uv_layers.new(name="UV").uv.foreach_set(
        "vector", np.tile((0, 0, 1, 0, 1, 1, 0, 1), count).astype("f")
    )
    half = 0.6 * FOREST
    corners = np.array([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)])
    ground = _mesh("Ground", corners, [range(4)])
    for mesh, color in ((leaf, (0.2, 0.5, 0.1)), (ground, (0.4, 0.3, 0.2))):
        material = bpy.data.materials.new(mesh.name)
        if bpy.app.version < (5, 0):
            material.use_nodes = True
        shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        shader.inputs["Base Color"].default_value = (*color, 1.0)
        mesh.materials.append(material)
        scene.collection.objects.link(bpy.data.objects.new(mesh.name, mesh))
    _cut_out(leaf.materials[0])
    _add_sun(scene)
    world = bpy.data.worlds.new("Sky")
    world.color = (0.6, 0.8, 1.0)
    scene.world = world
    return scene


def _levels(faces: list[tuple[int, int]], triangles: int) -> list[int]:
    """Return the level of each object by its quads and triangles; they get finer in turn."""
    levels = [PLAIN] * len(faces)
    total = sum(_subdivided(*face, PLAIN) for face in faces)
    for finer in range(PLAIN + 1, FINEST + 1):
        for number, face in enumerate(faces):
            if total >= triangles:
                return levels
            total += _subdivided(*face, finer) - _subdivided(*face, levels[number])
            levels[number] = finer
    return levels


def _subdivided(quads: int, corners_of_others: int, level: int) -> int:
    """Return the triangles of a mesh: level 1 makes one quad for every corner."""
    return 2 * (4 * quads + corners_of_others) * 4 ** (level - 1)


def _quads_and_triangles(mesh: bpy.types.Mesh) -> tuple[int, int]:
    """Return the number of a mesh's quads, and the corners of all other faces together."""
    corners = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_total", corners)
    return int((corners == 4).sum()), int(corners[corners != 4].sum())


def _project_uvs(mesh: bpy.types.Mesh) -> None:
    """Give a mesh UVs along the axis that each face looks along."""
    count, polygons = len(mesh.loops), len(mesh.polygons)
    vertices, loops = np.empty(3 * len(mesh.vertices)), np.empty(count, dtype=np.int32)
    normals, corners = np.empty(3 * polygons), np.empty(polygons, dtype=np.int32)
    mesh.vertices.foreach_get("co", vertices)
    mesh.loops.foreach_get("vertex_index", loops)
    mesh.polygons.foreach_get("normal", normals)
    mesh.polygons.foreach_get("loop_total", corners)
    axis = np.repeat(np.abs(normals.reshape(-1, 3)).argmax(axis=1), corners)
    places, rows = vertices.reshape(-1, 3)[loops] / TILE, np.arange(count)
    uv = np.stack([places[rows, (axis + 1) % 3], places[rows, (axis + 2) % 3]], axis=1)
    mesh.uv_layers.new(name="UV").uv.foreach_set("vector", uv.astype(np.float32).ravel())


def _give_image(material: bpy.types.Material) -> None:
    """Multiply a material's color with blotches in an image."""
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_DIFFUSE")
    color = np.array(shader.inputs["Color"].default_value[:3])
    random = np.random.default_rng(len(material.name))
    coarse = random.uniform(0.6, 1.2, (TEXTURE // 16, TEXTURE // 16, 1))
    shade = np.kron(coarse, np.ones((16, 16, 1))) * random.uniform(0.9, 1.1, (TEXTURE, TEXTURE, 1))
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = _image(material.name, np.append(np.clip(shade * color, 0, 1), np.ones_like(shade), axis=2))
    tree.links.new(node.outputs["Color"], shader.inputs["Color"])


def _cut_out(material: bpy.types.Material) -> None:
    """Cut leaves out of cards by an image's alpha."""
    v, u = np.mgrid[0:TEXTURE, 0:TEXTURE] / TEXTURE
    inside = np.abs(u - 0.5) < 0.4 * np.sin(np.pi * v) * (0.7 + 0.3 * np.cos(40 * v))
    pixels = np.stack([0.2 + 0.1 * v, 0.5 - 0.1 * u, 0.1 + 0 * u, inside.astype(float)], axis=2)
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = _image("Leaf", pixels)
    tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    tree.links.new(node.outputs["Alpha"], shader.inputs["Alpha"])


def _image(name: str, pixels: np.ndarray) -> bpy.types.Image:
    """Return a packed image of (h, w, 4) colors."""
    image = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0], alpha=True)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.pack()
    return image


def _mesh(name: str, vertices: np.ndarray, faces: Iterable[Iterable[int]]) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], [tuple(int(v) for v in face) for face in faces])
    mesh.update()
    return mesh


def _add_sun(scene: bpy.types.Scene) -> None:
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle = 20.0, 0.01
    obj = bpy.data.objects.new("Sun", sun)
    obj.rotation_euler = SUN
    scene.collection.objects.link(obj)


if __name__ == "__main__":
    kind, count, path = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    empty_scene()
    if kind == "foliage":
        build_foliage(count)
    else:
        build_dense_office(count, int(sys.argv[4]) if len(sys.argv) > 4 else 0)
    bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()), compress=True)
