"""Geometry: whatever becomes a mesh when it is rendered."""

from __future__ import annotations

import math

import bpy

from . import row
from .stage import add_box, add_lamp, add_mesh, add_object, diffuse, stage

CUBE = tuple((x, y, z) for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5))
CUBE_FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def lit(blockers: bool = False) -> None:
    """Build the stage, empty but for its walls, and a soft lamp."""
    stage(0.6, blockers)
    add_lamp("POINT", energy=150, shadow_soft_size=0.1)


def bare(name: str, vertices: tuple, faces: tuple, albedo: float = 0.6, **transform) -> bpy.types.Object:
    """Add a mesh that lights and blocks but has no lightmap."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(diffuse(name, albedo))
    return add_object(name, mesh, **transform)


@row("polygons")
def polygons() -> None:
    """A concave n-gon with a lightmap, loose edges and vertices, and flat triangles."""
    lit()
    star = [
        (r * math.cos(math.pi * i / 6), r * math.sin(math.pi * i / 6), 0.7)
        for i, r in enumerate((0.9, 0.35) * 6)
    ]
    uv = [(105 + 21 * x / 0.9, 20 + 18 * y / 0.9 + 85) for x, y, _ in star]
    uv = [(u, min(max(v, 84), 126)) for u, v in uv]
    made = add_mesh("Star", star, (tuple(range(12)),), uv, diffuse("Star", 0.6))
    made.data.vertices.add(4)
    for vertex, place in zip(range(12, 16), ((0, 0, 2), (1, 1, 2), (0.2, 0, 2), (0.4, 0, 2)), strict=True):
        made.data.vertices[vertex].co = place
    made.data.edges.add(2)
    made.data.edges[-1].vertices, made.data.edges[-2].vertices = (12, 13), (14, 15)
    made.data.update()


@row("bad-meshes")
def bad_meshes() -> None:
    """Flipped faces, doubled faces, three faces on an edge, and bodies that run through each other."""
    lit()
    some_flipped = tuple(face[::-1] if i % 2 else face for i, face in enumerate(CUBE_FACES))
    bare("Flipped", CUBE, some_flipped, location=(-0.9, 0.8, 0.6), rotation_euler=(0, 0, 0.3))
    # A hair apart: between faces in one place Cycles loses light.
    doubled = CUBE_FACES + tuple(tuple(i + 8 for i in face) for face in CUBE_FACES)
    inner = tuple((0.998 * x, 0.998 * y, 0.998 * z) for x, y, z in CUBE)
    bare("Doubled", CUBE + inner, doubled, location=(0.4, 1.0, 0.5), scale=(0.7, 0.7, 0.8))
    bare(
        "Crossing",
        CUBE,
        CUBE_FACES,
        location=(0.6, 1.2, 0.6),
        rotation_euler=(0.4, 0.5, 0.6),
        scale=(0.6,) * 3,
    )
    fin = ((0, 0, 0), (0, 0, 1), (0.6, 0, 0), (-0.4, 0.5, 0), (-0.4, -0.5, 0), (0, 0, 0.5), (1e-9, 0, 0.7))
    bare("Fins", fin, ((0, 1, 2), (0, 1, 3), (0, 1, 4), (0, 5, 6), (0, 1, 5)), location=(-0.7, -0.6, 0))


def ball(rows: int, columns: int, radius: float) -> tuple[list, list, list]:
    """Return a sphere's vertices, quads, and texels by corner; poles are rings of no radius."""
    vertices, faces, uv = [], [], []
    for i in range(rows + 1):
        for j in range(columns):
            t, p = math.pi * i / rows, 2 * math.pi * j / columns
            vertices.append(
                (
                    radius * math.sin(t) * math.cos(p),
                    radius * math.sin(t) * math.sin(p),
                    -radius * math.cos(t),
                )
            )
    left, bottom, right, top = 83, 83, 127, 127
    for i in range(rows):
        for j in range(columns):
            k = (j + 1) % columns
            ring = [(i, j, j), (i, k, j + 1), (i + 1, k, j + 1), (i + 1, j, j)]
            if i == 0:
                ring = [ring[0], *ring[2:]]
            elif i == rows - 1:
                ring = ring[:3]
            faces.append([row_ * columns + column for row_, column, _ in ring])
            uv += [
                (left + (right - left) * u / columns, bottom + (top - bottom) * v / rows) for v, _, u in ring
            ]
    return vertices, faces, uv


@row("resting-boxes")
def resting_boxes() -> None:
    """Boxes that stand on the floor and on each other: faces in one plane, back to back."""
    lit()
    paint = diffuse("Boxes", 0.6)
    add_box("Lower", (0.8, 0.8, 0.6), (83, 105, 127, 127), paint, location=(-0.3, 0.5, 0.3), turn=0.4)
    add_box("Upper", (0.5, 0.5, 0.5), (83, 83, 127, 105), paint, location=(-0.3, 0.5, 0.85), turn=-0.2)
    bare("Bare", CUBE, CUBE_FACES, location=(0.9, 1.1, 0.4), scale=(0.5, 0.5, 0.8))


@row("smooth-sphere")
def smooth_sphere() -> None:
    """A coarse sphere that is shaded smooth."""
    lit()
    made = add_mesh("Ball", *ball(8, 12, 0.7), diffuse("Ball", 0.6))
    made.location = (-0.1, 0.4, 0.9)
    made.data.polygons.foreach_set("use_smooth", [True] * len(made.data.polygons))


@row("instances")
def instances() -> None:
    """Collection instances, one in another, mirrored and stretched, and linked duplicates."""
    lit()
    inner, outer = bpy.data.collections.new("Inner"), bpy.data.collections.new("Outer")
    part = bare("Part", CUBE, CUBE_FACES, scale=(0.3, 0.3, 0.6))
    bpy.context.scene.collection.objects.unlink(part)
    inner.objects.link(part)
    for number, place in enumerate(((0, 0, 0.3), (0.6, 0, 0.3))):
        nested = add_object(
            f"Nested {number}", None, outer, location=place, rotation_euler=(0, 0, 0.5 * number)
        )
        nested.instance_type, nested.instance_collection = "COLLECTION", inner
    for number, (place, scale) in enumerate((((-1.2, 0.5, 0), (1, 1, 1)), ((0.3, 1.0, 0), (-1, 1.5, 1.6)))):
        empty = add_object(f"Empty {number}", None, location=place, scale=scale)
        empty.instance_type, empty.instance_collection = "COLLECTION", outer
    for number in range(2):
        add_object(f"Copy {number}", part.data, location=(1.1, number - 0.3, 0.2), scale=(0.2, 0.2, 0.4))


@row("geometry-nodes")
def geometry_nodes() -> None:
    """Cubes that geometry nodes put on the points of a grid."""
    lit()
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    grid, cube, scatter, paint = (
        tree.nodes.new(f"GeometryNode{kind}")
        for kind in ("MeshGrid", "MeshCube", "InstanceOnPoints", "SetMaterial")
    )
    for name, value in (("Size X", 2.0), ("Size Y", 1.6), ("Vertices X", 3), ("Vertices Y", 3)):
        grid.inputs[name].default_value = value
    cube.inputs["Size"].default_value = (0.25, 0.25, 0.5)
    paint.inputs["Material"].default_value = diffuse("Scattered", 0.6)
    leave = tree.nodes.new("NodeGroupOutput")
    tree.links.new(cube.outputs["Mesh"], paint.inputs["Geometry"])
    tree.links.new(grid.outputs["Mesh"], scatter.inputs["Points"])
    tree.links.new(paint.outputs["Geometry"], scatter.inputs["Instance"])
    tree.links.new(scatter.outputs["Instances"], leave.inputs[0])
    bare("Points", CUBE, (), location=(-0.3, 0.5, 0.3)).modifiers.new("Nodes", "NODES").node_group = tree


@row("curves-texts-metaballs")
def curves_texts_metaballs() -> None:
    """A bent pipe, an extruded letter, and two metaballs that melt together."""
    lit()
    paint = diffuse("Other", 0.6)
    pipe = bpy.data.curves.new("Pipe", "CURVE")
    pipe.dimensions, pipe.bevel_depth = "3D", 0.12
    spline = pipe.splines.new("POLY")
    spline.points.add(2)
    for point, place in zip(spline.points, ((-1.2, 1, 0), (-1.2, 1, 1.2), (-0.3, 1.4, 1.2)), strict=True):
        point.co = (*place, 1)
    letter = bpy.data.curves.new("Letter", "FONT")
    letter.body, letter.extrude, letter.size = "R", 0.08, 1.2
    balls = bpy.data.metaballs.new("Balls")
    balls.resolution = balls.render_resolution = 0.1
    for place in ((0, 0, 0), (0.5, 0, 0.1)):
        element = balls.elements.new()
        element.co, element.radius = place, 0.5
    for data, transform in (
        (pipe, {}),
        (letter, {"location": (0.2, 1.2, 0.1), "rotation_euler": (math.pi / 2, 0, 0.2)}),
        (balls, {"location": (-0.9, -0.4, 0.5)}),
    ):
        data.materials.append(paint)
        add_object(data.name, data, **transform)


@row("ray-visibility")
def ray_visibility() -> None:
    """Boxes that lamps' light goes through, or that do not bounce, and a holdout."""
    lit()
    for number, (attribute, value) in enumerate(
        (("visible_shadow", False), ("visible_diffuse", False), ("is_holdout", True))
    ):
        box = bare(
            f"Box {number}", CUBE, CUBE_FACES, 0.8, location=(number - 1.1, 0.7, 0.6), scale=(0.5, 0.5, 1)
        )
        setattr(box, attribute, value)


def moved(place: tuple[float, float, float], scale: float) -> None:
    """Move and scale all there is, its light to suit."""
    for obj in bpy.context.scene.objects:
        obj.location = [p + scale * x for p, x in zip(place, obj.location, strict=True)]
        obj.scale = [scale * s for s in obj.scale]
        if obj.type == "LIGHT":
            obj.data.energy *= scale**2
            obj.data.shadow_soft_size *= scale
            obj.scale = (1, 1, 1)


@row("far-away")
def far_away() -> None:
    """The stage 10 km from the origin."""
    lit(blockers=True)
    moved((7000.0, -7000.0, 1000.0), 1.0)


@row("ten-kilometers")
def ten_kilometers() -> None:
    """The stage 10 km wide."""
    lit(blockers=True)
    moved((0.0, 0.0, 0.0), 2500.0)


@row("a-millimeter")
def a_millimeter() -> None:
    """The stage 1 mm wide."""
    lit(blockers=True)
    moved((0.0, 0.0, 0.0), 0.00025)
