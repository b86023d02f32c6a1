"""Random meshes, most of them bad: layered, overlapping, without area, tiny, huge, empty."""

from __future__ import annotations

import math
from random import Random

import bmesh
import bpy

Corners = list[tuple[float, float, float]]
Faces = list[tuple[int, ...]]

BOX_FACES: Faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
"""Facing outwards, of corners counted in x, then y, then z."""


def box(size: float = 1.0) -> tuple[Corners, Faces]:
    corners = [(size * x, size * y, size * z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    return corners, BOX_FACES


def sheet(width: float, height: float, at: float = 0.0) -> Corners:
    return [(-width, -height, at), (width, -height, at), (width, height, at), (-width, height, at)]


def layers(random: Random) -> tuple[Corners, Faces]:
    """Sheets in one place, or a hair apart, the same way round or not."""
    gap = random.choice((0.0, 0.0, 1e-7, 9e-7, 1e-6, 1e-5, 1e-3))
    corners: Corners = []
    faces: Faces = []
    for number in range(random.randint(2, 6)):
        corners += sheet(1.0, random.choice((1.0, 1.0, 0.6)), number * gap)
        face = tuple(range(4 * number, 4 * number + 4))
        faces.append(face[::-1] if random.random() < 0.2 else face)
    return corners, faces


def soup(random: Random) -> tuple[Corners, Faces]:
    count = random.randint(1, 14)
    size = random.choice((1.0, 1.0, 0.1))
    corners: Corners = []
    for _ in range(count):
        near = [random.uniform(-1, 1) for _ in range(3)]
        corners += [tuple(n + random.uniform(-size, size) for n in near) for _ in range(3)]  # type: ignore[misc]
    return corners, [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(count)]


def coplanar(random: Random) -> tuple[Corners, Faces]:
    """Triangles that overlap each other in one plane."""
    count = random.randint(2, 8)
    corners = [(random.uniform(-1, 1), random.uniform(-1, 1), 0.0) for _ in range(3 * count)]
    return corners, [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(count)]


def needles(random: Random) -> tuple[Corners, Faces]:
    """Triangles with little area or none, and corners in one place."""
    thin = random.choice((0.0, 1e-9, 1e-6, 1e-4))
    corners: Corners = [(0, 0, 0), (1, 0, 0), (1, thin, 0), (0, 1, 0), (0, 0, 0), (0.5, 0, thin), (0, 0, 1)]
    faces: Faces = [(0, 1, 2), (0, 1, 3), (0, 4, 1), (0, 1, 5), (3, 6, 5), (2, 4, 6)]
    return corners, random.sample(faces, random.randint(1, len(faces)))


def hull(random: Random) -> tuple[Corners, Faces]:
    work = bmesh.new()
    for _ in range(random.randint(4, 12)):
        work.verts.new([random.uniform(-1, 1) for _ in range(3)])
    bmesh.ops.convex_hull(work, input=work.verts)
    loose = [vert for vert in work.verts if not vert.link_faces]
    bmesh.ops.delete(work, geom=loose, context="VERTS")
    work.verts.index_update()
    corners = [tuple(vert.co) for vert in work.verts]
    faces = [tuple(vert.index for vert in face.verts) for face in work.faces]
    work.free()
    return corners, faces


def polygon(random: Random) -> tuple[Corners, Faces]:
    """One face with many corners, concave, bent, or crossing itself."""
    count, bend = random.randint(5, 20), random.choice((0.0, 0.5))
    order = list(range(count))
    if random.random() < 0.3:
        random.shuffle(order)
    corners = [
        (
            math.cos(2 * math.pi * i / count) * (0.4 + 0.6 * (i % 2)),
            math.sin(2 * math.pi * i / count),
            bend * (i % 3),
        )
        for i in range(count)
    ]
    return corners, [tuple(order)]


def hills(random: Random) -> tuple[Corners, Faces]:
    n = random.randint(2, 6)
    corners = [
        (2 * x / n - 1, 2 * y / n - 1, 0.3 * random.random()) for y in range(n + 1) for x in range(n + 1)
    ]
    starts = [y * (n + 1) + x for y in range(n) for x in range(n)]
    return corners, [(c, c + 1, c + n + 2, c + n + 1) for c in starts]


def inside_out(_: Random) -> tuple[Corners, Faces]:
    corners, faces = box(2.5)
    return corners, [face[::-1] for face in faces]


def doubled_faces(random: Random) -> tuple[Corners, Faces]:
    """Each face several times, by the same corners."""
    corners, faces = box(0.5)
    return corners, [face for face in faces for _ in range(random.randint(1, 3))]


def loose(random: Random) -> tuple[Corners, Faces]:
    corners, faces = box(0.5)
    return [*corners, (3, 3, 3), (4, 4, 4)], faces[: random.randint(0, 3)]


def nothing(_: Random) -> tuple[Corners, Faces]:
    return [], []


def plain_box(_: Random) -> tuple[Corners, Faces]:
    return box(0.5)


def plain_sheet(_: Random) -> tuple[Corners, Faces]:
    return sheet(1.5, 1.0), [(0, 1, 2, 3)]


SHAPES = (
    *(layers, layers, soup, soup, coplanar, coplanar, needles, hull, hull, polygon, hills, hills, inside_out),
    *(doubled_faces, loose, nothing, plain_box, plain_box, plain_sheet, plain_sheet),
)


def random_mesh(random: Random, name: str) -> bpy.types.Mesh:
    """Make a mesh, with whatever layers and attributes it may have."""
    corners, faces = random.choice(SHAPES)(random)
    if random.random() < 0.08:
        scale = random.choice((1e-5, 1e-3, 1e3, 1e5))
        corners = [(scale * x, scale * y, scale * z) for x, y, z in corners]
    if random.random() < 0.04:
        corners = [(x + 1e6, y, z) for x, y, z in corners]
    if corners and random.random() < 0.02:
        corners[0] = (random.choice((math.nan, math.inf, 1e38)), 0.0, 0.0)
    made = bpy.data.meshes.new(name)
    made.from_pydata(corners, [], faces)
    if faces and random.random() < 0.4:
        made.polygons.foreach_set("use_smooth", [random.random() < 0.7 for _ in made.polygons])
    for _ in range(random.choice((0, 0, 0, 1, 2, 8))):
        _uv_layer(random, made)
    if random.random() < 0.15 and corners:
        made.attributes.new("Weight", random.choice(("FLOAT", "INT", "FLOAT_VECTOR", "BOOLEAN")), "POINT")
    if random.random() < 0.1 and faces:
        made.color_attributes.new("Color", "FLOAT_COLOR", "CORNER")
    return made


def _uv_layer(random: Random, made: bpy.types.Mesh) -> None:
    layer = made.uv_layers.new(name=random.choice(("UVMap", "Lightmap", "Lightmap", "karte é")))
    if layer is None:
        return
    low, high = random.choice(((0.0, 1.0), (-3.0, 2.0), (0.5, 0.5)))
    values = [random.uniform(low, high) for _ in range(2 * len(made.loops))]
    if values and random.random() < 0.1:
        values[0] = random.choice((math.nan, math.inf, 1e30))
    layer.data.foreach_set("uv", values)
    layer.active_render = random.random() < 0.5
