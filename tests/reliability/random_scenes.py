"""Random scenes: shared meshes, modifiers, instances, several scenes, roles, hidden objects."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import bpy
from mathutils import Euler, Vector

from . import random_looks as looks
from . import random_meshes as meshes

MODIFIERS = (
    *("SUBSURF", "ARRAY", "MIRROR", "SOLIDIFY", "BEVEL", "TRIANGULATE", "DECIMATE", "WIREFRAME", "DISPLACE"),
    *("WELD", "EDGE_SPLIT", "SIMPLE_DEFORM", "BOOLEAN", "REMESH"),
)

MOST_FACES = 300
"""Of an object with its modifiers."""

MOST_CORNERS = 60
"""Of meshes that get a modifier."""


@dataclass
class Known:
    """A scene of which all is known that decides its light; see `light.py`."""

    reflectance: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    """Of each object."""
    emission: dict[str, float] = field(default_factory=dict)
    """Emission strength of each object that emits: radiance, from both sides."""


def build(random: Random) -> None:
    """Fill the open file, which is empty."""
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.world = looks.world(random)
    scale = random.choice((1.0, 1.0, 1.0, 1.0, 0.01, 100.0))
    center = Vector(random.choice(((0, 0, 0), (0, 0, 0), (0, 0, 0), (1e4, -1e4, 1e3))))
    materials = [_material(random, number) for number in range(random.randint(1, 4))]
    shared = [_mesh(random, number, materials) for number in range(random.randint(1, 4))]
    group = bpy.data.collections.new(looks.name(random, "Group"))
    inner = bpy.data.collections.new("Inner")
    (scene.collection if random.random() < 0.7 else group).children.link(inner)
    if random.random() < 0.3:
        scene.collection.children.link(group)
    made = []
    for number in range(random.randint(1, 6)):
        home = random.choice((scene.collection, scene.collection, scene.collection, inner, group))
        obj = bpy.data.objects.new(looks.name(random, f"Thing {number}"), random.choice(shared))
        home.objects.link(obj)
        _place(random, obj, center, scale)
        if made and random.random() < 0.15:
            obj.parent = random.choice(made)
        if random.random() < 0.25 and len(obj.data.vertices) < MOST_CORNERS:
            _modify(random, obj)
        if random.random() < 0.1 and obj.material_slots:
            obj.material_slots[0].link = "OBJECT"
            obj.material_slots[0].material = random.choice(materials)
        made.append(obj)
    for number in range(random.randint(0, 2)):
        bulb = bpy.data.objects.new(looks.name(random, f"Lamp {number}"), looks.lamp(random))
        scene.collection.objects.link(bulb)
        _place(random, bulb, center, scale)
        if random.random() < 0.3:
            bulb.radiosity_light_group = random.choice(("Küche", "A", "x" * 48))
    if group.objects and random.random() < 0.7:
        for number in range(random.randint(1, 2)):
            empty = bpy.data.objects.new(f"Instance {number}", None)
            scene.collection.objects.link(empty)
            empty.instance_type, empty.instance_collection = "COLLECTION", group
            _place(random, empty, center, 1.0)
    if random.random() < 0.25:
        _second_scene(random, made)
    bpy.context.view_layer.update()
    _lighten(made)
    for obj in made:
        _set_roles(random, obj)
    bpy.context.view_layer.update()
    _set_options(random, scene)


def _material(random: Random, number: int) -> bpy.types.Material | None:
    title = looks.name(random, f"Paint {number}")
    draw = random.random()
    if draw < 0.4:
        return looks.plain_material(random, title)
    if draw < 0.5:
        return looks.emitter(title, random.choice((0.0, 1.0, 20.0)))
    return looks.wild_material(random, title) if draw < 0.95 else None


def _mesh(random: Random, number: int, materials: list) -> bpy.types.Mesh:
    made = meshes.random_mesh(random, looks.name(random, f"Mesh {number}"))
    for material in random.sample(materials, random.randint(0, len(materials))):
        made.materials.append(material)
    slots = max(1, len(made.materials)) + (random.random() < 0.05)
    made.polygons.foreach_set("material_index", [random.randrange(slots) for _ in made.polygons])
    return made


def _place(random: Random, obj: bpy.types.Object, center: Vector, scale: float) -> None:
    obj.location = center + scale * Vector(random.uniform(-2, 2) for _ in range(3))
    obj.rotation_euler = Euler(random.choice((0.0, 0.0, math.pi / 2, random.uniform(0, 6))) for _ in range(3))
    stretch = [random.choice((1.0, 1.0, 1.0, -1.0, 0.2, 3.0)) for _ in range(3)]
    if random.random() < 0.03:
        stretch[random.randrange(3)] = 0.0
    obj.scale = [scale * each for each in stretch] if obj.type == "MESH" else stretch


def _modify(random: Random, obj: bpy.types.Object) -> None:
    for kind in random.sample(MODIFIERS, random.choice((1, 1, 2))):
        modifier = obj.modifiers.new(random.choice((kind, kind, "Ünïcödé")), kind)
        if modifier is None:
            continue
        if kind == "SUBSURF":
            modifier.levels = modifier.render_levels = 1
        elif kind == "REMESH":
            modifier.mode, modifier.octree_depth = "BLOCKS", 2
        modifier.show_viewport = random.random() < 0.85
        modifier.show_render = random.random() < 0.85


def _lighten(made: list[bpy.types.Object]) -> None:
    """Take the modifiers off where they make more faces than can be baked in a moment."""
    context = bpy.context.evaluated_depsgraph_get()
    for obj in made:
        evaluated = obj.evaluated_get(context)
        count = len(evaluated.to_mesh().polygons)
        evaluated.to_mesh_clear()
        if count > MOST_FACES:
            obj.modifiers.clear()


def _second_scene(random: Random, made: list[bpy.types.Object]) -> None:
    """Add a scene that shares some objects."""
    other = bpy.data.scenes.new(looks.name(random, "Second"))
    for obj in made:
        if random.random() < 0.4:
            other.collection.objects.link(obj)
    floor = bpy.data.meshes.new("Second floor")
    floor.from_pydata(meshes.sheet(2, 2), [], [(0, 1, 2, 3)])
    other.collection.objects.link(bpy.data.objects.new("Second floor", floor))
    lamp = bpy.data.lights.new("Second lamp", "POINT")
    lamp.energy = 50
    bulb = bpy.data.objects.new("Second lamp", lamp)
    bulb.location = (0, 0, 2)
    other.collection.objects.link(bulb)
    _set_options(random, other)


def _set_roles(random: Random, obj: bpy.types.Object) -> None:
    obj.radiosity_mode = random.choices(("BAKE", "LIGHT_ONLY", "IGNORE"), (12, 1, 1))[0]
    if random.random() < 0.2:
        obj.radiosity_texel_scale = random.choice((0.1, 5.0))
    for switch in (
        "visible_diffuse",
        "visible_shadow",
        "visible_camera",
        "hide_render",
        "hide_viewport",
        "is_holdout",
    ):
        if random.random() < 0.05:
            setattr(obj, switch, not getattr(obj, switch))
    if random.random() < 0.05:
        with contextlib.suppress(RuntimeError):
            obj.hide_set(True)
    if random.random() < 0.1:
        obj.radiosity_light_group = random.choice(("Küche", "B"))


def _set_options(random: Random, scene: bpy.types.Scene) -> None:
    """Choose how the scene is baked: in a moment."""
    options = scene.radiosity
    options.resolution = random.choice((8, 8, 12, 16, 24))
    options.quality, options.min_area, options.error = "sketch", 0.5, 0.01
    options.threads = 1
    options.atlas = random.choice(("shared", "shared", "shared", "per-object"))
    if options.atlas == "shared":
        options.pages = random.choice((1, 1, 2))
    options.quantity = random.choice(("irradiance_over_pi", "irradiance", "radiosity"))
    options.light = random.choice(("all", "all", "all", "direct", "indirect"))
    options.format = random.choice(("exr", "exr", "png16"))
    options.keep_uvs = random.random() < 0.3
    options.sky = random.random() < 0.6
    options.use_light_groups = random.random() < 0.2
    options.seed = random.randrange(100)
    if random.random() < 0.1:
        options.scope = "selected"
        for obj in scene.objects:
            with contextlib.suppress(RuntimeError):
                obj.select_set(random.random() < 0.6)
    relight = scene.radiosity_relight
    relight.keep = random.random() < 0.5
    relight.sidecar = random.random() < 0.2


def build_known(random: Random) -> Known:
    """Fill the open file with diffuse objects and emitters, whose light `light.py` can compute."""
    known = Known()
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 16
    if random.random() < 0.7:
        _known_thing(known, random, "Room", meshes.inside_out(random), Vector(), 1.0)
    else:
        _known_thing(
            known, random, "Floor", (meshes.sheet(2.5, 2.5), [(0, 1, 2, 3)]), Vector((0, 0, -1)), 1.0
        )
    for number in range(random.randint(0, 2)):
        place = Vector((-1.2 + 2.4 * number, random.uniform(-1, 1), -0.75))
        shape = random.choice((meshes.plain_box, meshes.hull, meshes.plain_sheet))
        _known_thing(known, random, f"Thing {number}", shape(random), place, 0.5)
    shape = random.choice(
        (meshes.layers, meshes.layers, meshes.coplanar, meshes.doubled_faces, meshes.plain_sheet)
    )
    corners, faces = shape(random)
    _known_thing(known, random, "Glow", (corners, faces), Vector((0, 0, 1)), 0.5, random.uniform(0.5, 20))
    _set_options(random, scene)
    options = scene.radiosity
    options.resolution, options.format, options.light, options.quantity = 64, "exr", "all", "irradiance"
    options.atlas, options.pages, options.scope, options.min_area = "shared", 1, "all", 0.1
    options.keep_uvs, options.use_light_groups, options.sky = False, False, False
    bpy.context.view_layer.update()
    return known


def _known_thing(
    known: Known, random: Random, title: str, shape: tuple, place: Vector, scale: float, emission: float = 0.0
) -> None:
    corners, faces = shape
    mesh = bpy.data.meshes.new(title)
    mesh.from_pydata(corners, [], faces)
    if emission:
        mesh.materials.append(looks.emitter(title, emission))
        mesh.materials[0].node_tree.nodes["Emission"].inputs["Color"].default_value = (1, 1, 1, 1)
        known.emission[title] = emission
        known.reflectance[title] = (0.0, 0.0, 0.0)
    else:
        mesh.materials.append(bpy.data.materials.new(title))
        tree = looks.emptied(mesh.materials[0])
        shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
        shader.inputs[0].default_value = looks.color(random, 0.8)
        tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
        known.reflectance[title] = tuple(shader.inputs[0].default_value)[:3]
    obj = bpy.data.objects.new(title, mesh)
    obj.location, obj.scale = place, (scale, scale, scale)
    bpy.context.scene.collection.objects.link(obj)


def save(random: Random, folder: Path) -> Path | None:
    """Save the open file, most of the time; returns where."""
    if random.random() < 0.15:
        return None
    title = random.choice(("room", "room", "küche", "レストラン", "a b", "lightmap"))
    path = folder / f"{title}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
    return path
