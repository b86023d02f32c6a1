"""Surfaces of every sort, good and bad, drawn by a random generator."""

from __future__ import annotations

import math
from collections.abc import Callable
from random import Random

import bpy

from tests.blender.exporting import CUBE, CUBE_FACES, scatter_nodes

Vertices = list[tuple[float, float, float]]
Faces = list[tuple[int, ...]]
Mesh = tuple[Vertices, list[tuple[int, int]], Faces]


def cube(_: Random) -> Mesh:
    return list(CUBE), [], list(CUBE_FACES)


def room(_: Random) -> Mesh:
    """A cube seen from inside."""
    return [(3 * x, 3 * y, 3 * z) for x, y, z in CUBE], [], [face[::-1] for face in CUBE_FACES]


def grid(random: Random) -> Mesh:
    """A sheet, flat or hilly."""
    n, hills = random.randint(2, 5), random.choice((0.0, 0.3))
    vertices = [
        (2 * x / n - 1, 2 * y / n - 1, hills * random.random()) for y in range(n + 1) for x in range(n + 1)
    ]
    corners = [y * (n + 1) + x for y in range(n) for x in range(n)]
    return vertices, [], [(c, c + 1, c + n + 2, c + n + 1) for c in corners]


def ngon(random: Random) -> Mesh:
    """A star with many corners, concave, now and then folded."""
    n, fold = random.randint(5, 14), random.choice((0.0, 0.0, 0.4))
    radius = [1.0 if i % 2 else random.uniform(0.3, 1.0) for i in range(n)]
    angle = [2 * math.pi * i / n for i in range(n)]
    vertices = [
        (r * math.cos(a), r * math.sin(a), fold * random.random()) for r, a in zip(radius, angle, strict=True)
    ]
    return vertices, [], [tuple(range(n))]


def ball(random: Random) -> Mesh:
    rows, columns = random.randint(3, 5), random.randint(4, 8)
    vertices = [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    for i in range(1, rows):
        for j in range(columns):
            t, p = math.pi * i / rows, 2 * math.pi * j / columns
            vertices.append((math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)))

    def at(i: int, j: int) -> int:
        return 2 + (i - 1) * columns + j % columns

    faces: Faces = [(0, at(1, j), at(1, j + 1)) for j in range(columns)]
    faces += [(1, at(rows - 1, j + 1), at(rows - 1, j)) for j in range(columns)]
    faces += [
        (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))
        for i in range(1, rows - 1)
        for j in range(columns)
    ]
    return vertices, [], faces


def soup(random: Random) -> Mesh:
    """Triangles that run through each other."""
    count = random.randint(1, 12)
    vertices = [tuple(random.uniform(-1, 1) for _ in range(3)) for _ in range(3 * count)]
    return vertices, [], [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(count)]  # type: ignore[return-value]


def loose(random: Random) -> Mesh:
    """Faces, edges and vertices that belong to nothing; now and then there are no faces."""
    vertices, _, faces = cube(random)
    faces = faces[: random.randint(0, 6)]
    return [*vertices, (2, 2, 2), (3, 3, 3), (0, 0, 5)], [(8, 9), (0, 8)], faces


def doubled(random: Random) -> Mesh:
    """Faces that lie on each other: the same way round, turned, and a little apart."""
    vertices, _, faces = cube(random)
    lift = random.choice((0.0, 1e-7, 1e-3))
    again = [(x, y, z + lift) for x, y, z in vertices]
    turned = [tuple(i + 8 for i in (face[::-1] if random.random() < 0.5 else face)) for face in faces]
    return vertices + again, [], faces + turned


def flipped(random: Random) -> Mesh:
    vertices, _, faces = cube(random)
    return vertices, [], [face[::-1] if random.random() < 0.5 else face for face in faces]


def flat_triangles(random: Random) -> Mesh:
    """Triangles without area, needles, and corners in one place, beside good ones."""
    vertices: Vertices = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (0, 0, 0), (1e-6, 0, 0), (0, 1, 1e-7)]
    faces: Faces = [(0, 1, 3), (0, 1, 2), (0, 4, 1), (0, 5, 3), (3, 6, 1)]
    return vertices, [], random.sample(faces, random.randint(1, len(faces)))


def three_on_an_edge(_: Random) -> Mesh:
    vertices: Vertices = [(0, 0, 0), (0, 0, 1), (1, 0, 0), (-1, 1, 0), (-1, -1, 0)]
    return vertices, [], [(0, 1, 2), (0, 1, 3), (0, 1, 4)]


def empty(_: Random) -> Mesh:
    return [], [], []


SHAPES: tuple[Callable[[Random], Mesh], ...] = (
    *(cube, room, grid, grid, ngon, ball, ball, soup, loose, doubled, flipped),
    *(flat_triangles, three_on_an_edge, empty),
)


def mesh(random: Random) -> bpy.types.Mesh:
    """Make a random mesh; half of them are smooth, some bring UV layers."""
    shape = random.choice(SHAPES)
    vertices, edges, faces = shape(random)
    made = bpy.data.meshes.new(shape.__name__)
    made.from_pydata(vertices, edges, faces)
    if random.random() < 0.5:
        made.polygons.foreach_set("use_smooth", [True] * len(made.polygons))
    if random.random() < 0.2 and faces:
        _uv_layer(random, made, random.choice(("UVMap", "Lightmap")))
    return made


def _uv_layer(random: Random, made: bpy.types.Mesh, name: str) -> None:
    """Add UVs: in the square, outside it, in one point, or NaN."""
    layer = made.uv_layers.new(name=name)
    low, high = random.choice(((0.0, 1.0), (-2.0, 3.0), (0.5, 0.5)))
    values = [random.uniform(low, high) for _ in range(2 * len(made.loops))]
    if random.random() < 0.1:
        values[0] = math.nan
    layer.data.foreach_set("uv", values)


def other_surface(random: Random) -> bpy.types.ID:
    """Make a curve, a text, or a metaball."""
    kind = random.choice(("CURVE", "FONT", "META"))
    if kind == "META":
        ball = bpy.data.metaballs.new("Ball")
        ball.resolution = ball.render_resolution = 0.8
        ball.elements.new().radius = random.uniform(0.8, 2.0)
        return ball
    data = bpy.data.curves.new(kind.title(), kind)
    data.resolution_u = 2
    if kind == "FONT":
        data.body = random.choice(("A", "i", "", "Ä1"))
        data.extrude = random.choice((0.0, 0.2))
        return data
    data.dimensions, data.bevel_resolution = "3D", 0
    data.bevel_depth = random.choice((0.0, 0.2))
    points = random.randint(1, 4)
    data.splines.new("POLY").points.add(points - 1)
    for point in data.splines[0].points:
        point.co = (*(random.uniform(-1, 1) for _ in range(3)), 1)
    return data


def add_modifier(random: Random, obj: bpy.types.Object) -> None:
    """Give a mesh object a modifier that changes what is there."""
    kind = random.choice(("SUBSURF", "ARRAY", "MIRROR", "SOLIDIFY", "NODES"))
    modifier = obj.modifiers.new(kind, kind)
    if kind == "SUBSURF":
        modifier.levels = modifier.render_levels = 1 if len(obj.data.polygons) < 10 else 0
    elif kind == "NODES":
        modifier.node_group = scatter_nodes(None)
        if len(obj.data.vertices) > 8:
            obj.modifiers.remove(modifier)
