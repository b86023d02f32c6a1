"""A city under sun and sky: hills, houses whose windows are recessed, domes, trees."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np

from .interior.blender_parts import add_mesh, diffuse
from .interior.shapes import Shape, grid, join, polygon

PITCH = 40.0
"""From one house to the next [m]."""

TILES, STEPS = 6, 80
"""Pieces of the ground along a side, and squares along a side of each."""

FLOOR, WINDOW, RECESS = 3.2, 4.0, 0.3
"""A floor's height, about how wide a window's part of the wall is, and how deep the window lies [m]."""

WALLS = 12
"""Colors of walls."""


def build_city(houses: int = 18) -> None:
    """Add a city of houses × houses to the open scene; 2.2 million triangles if there are 18."""
    random = np.random.default_rng(7)
    colors = {f"Wall {number}": tuple(random.uniform(0.35, 0.8, 3)) for number in range(WALLS)}
    colors |= {"Leaves": (0.1, 0.3, 0.06), "Soil": (0.3, 0.25, 0.2)}
    scene = bpy.context.scene
    materials = {name: diffuse(name, color) for name, color in colors.items()}
    for name, shape in [*_ground(houses), *_blocks(random, houses)]:
        add_mesh(scene, name, shape, materials)
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle = 4.0, 0.01
    lamp = bpy.data.objects.new("Sun", sun)
    lamp.rotation_euler = (0.7, 0.2, 0.4)
    scene.collection.objects.link(lamp)
    scene.world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.35, 0.5, 0.8, 1.0)


def _height(x: np.ndarray | float, y: np.ndarray | float) -> np.ndarray:
    return 2.0 * np.sin(np.divide(x, 60.0)) * np.cos(np.divide(y, 45.0))


def _ground(houses: int) -> Iterator[tuple[str, Shape]]:
    tile = houses * PITCH / TILES
    for i in range(TILES):
        for j in range(TILES):
            x, y = (tile * np.linspace(number, number + 1, STEPS + 1) for number in (i, j))
            x, y = np.meshgrid(x, y, indexing="ij")
            yield f"Ground {i} {j}", grid("Soil", np.stack([x, y, _height(x, y)], axis=-1))


def _blocks(random: np.random.Generator, houses: int) -> Iterator[tuple[str, Shape]]:
    for i in range(houses):
        for j in range(houses):
            x, y = (i + 0.5) * PITCH, (j + 0.5) * PITCH
            width, depth = random.uniform(12.0, 24.0, 2)
            floors = int(random.integers(3, 9))
            wall, dome = (f"Wall {int(random.integers(WALLS))}" for _ in range(2))
            ground, top = float(_height(x, y)), FLOOR * floors
            yield f"House {i} {j}", _house(wall, width, depth, top, floors).at(x, y, ground)
            cap = _bulb(dome, 0.4 * min(width, depth), 48, 16, 0.0, 0.0)
            yield f"Dome {i} {j}", cap.at(x, y, ground + top)
            for side in (-1, 1):
                tree_x, tree_y = x + side * random.uniform(15.0, 19.0), y + random.uniform(-15.0, 15.0)
                crown = _bulb("Leaves", random.uniform(1.2, 2.4), 32, 18, -np.pi / 2, 0.15)
                yield f"Tree {i} {j} {side}", crown.at(tree_x, tree_y, 4.0 + float(_height(tree_x, tree_y)))


def _house(paint: str, width: float, depth: float, top: float, floors: int) -> Shape:
    """Return four walls, from 2 m below the ground, and a flat roof."""
    x, y = width / 2, depth / 2
    corners = np.array([(-x, -y, -2.0), (x, -y, -2.0), (x, y, -2.0), (-x, y, -2.0)])
    walls = [_wall(paint, corners[k], corners[(k + 1) % 4], top + 2.0, floors) for k in range(4)]
    return join([*walls, polygon(paint, *(corners + np.array([0.0, 0.0, top + 2.0])))])


def _wall(paint: str, start: np.ndarray, end: np.ndarray, height: float, floors: int) -> Shape:
    length = float(np.linalg.norm(end - start))
    along, up = (end - start) / length, np.array([0.0, 0.0, 1.0])
    outward = np.cross(along, up)
    columns = max(int(length / WINDOW), 2)
    cell = np.array([length / columns, height / floors])
    outer = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    inner = np.array([(0.25, 0.25), (0.75, 0.25), (0.75, 0.85), (0.25, 0.85)])
    vertices, faces = [], []
    for column in range(columns):
        for floor in range(floors):
            first = len(vertices)
            for square, deep in ((outer, 0.0), (inner, 0.0), (inner, RECESS)):
                place = (square + np.array([column, floor])) * cell
                vertices += list(start + place[:, :1] * along + place[:, 1:] * up - deep * outward)
            for ring in (0, 4):
                for k in range(4):
                    near, far = first + ring + k, first + ring + (k + 1) % 4
                    faces.append((near, far, far + 4, near + 4))
            faces.append(tuple(range(first + 8, first + 12)))
    return Shape(np.array(vertices), faces, [paint] * len(faces))


def _bulb(paint: str, radius: float, around: int, rings: int, lowest: float, waves: float) -> Shape:
    """Return a dome from a latitude up to almost the top, perhaps wavy."""
    turn = np.linspace(0.0, 2 * np.pi, around + 1)
    turn, rise = np.meshgrid(turn, np.linspace(0.98 * lowest, 0.49 * np.pi, rings + 1), indexing="ij")
    reach = radius * (1.0 + waves * np.sin(5 * turn) * np.sin(4 * rise))
    flat = reach * np.cos(rise)
    return grid(paint, np.stack([flat * np.cos(turn), flat * np.sin(turn), reach * np.sin(rise)], axis=-1))
