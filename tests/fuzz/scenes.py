"""Random scenes: the same seed makes the same scene, and the same settings to bake it with."""

from __future__ import annotations

import math
from random import Random

import bpy
from mathutils import Matrix, Vector

from radiosity_addon.options.bake_settings import BakeSettings

from . import shapes, surfaces

SCALES = (1.0, 1.0, 1.0, 1e-3, 1e4)
"""Meters that a unit of the generator is long: rooms, pin heads, landscapes."""

SCENES = 500
"""How many the tests try."""

SMALL_METHODS = ("shooting", "gauss-seidel", "two-level", "multi-level")


def build(seed: int) -> BakeSettings:
    """Fill the open file, which is empty, with the scene of a seed; return how to bake it."""
    random = Random(seed)
    scale = random.choice(SCALES)
    center = Vector(random.choice(((0, 0, 0), (0, 0, 0), (1e4, -1e4, 1e3)))) * scale
    surfaces.world(random)
    materials = [surfaces.material(random) for _ in range(random.randint(1, 3))]
    meshes = [_painted(random, shapes.mesh(random), materials) for _ in range(random.randint(1, 4))]
    group = bpy.data.collections.new("Group")
    things = []
    for number in range(random.randint(1, 5)):
        inside = group if random.random() < 0.25 else None
        if random.random() < 0.15:
            data = _painted(random, shapes.other_surface(random), materials)
        else:
            data = random.choice(meshes)
        obj = _add(random, f"Thing {number}", data, Vector() if inside else center, scale, inside)
        if obj.type == "MESH" and random.random() < 0.2:
            shapes.add_modifier(random, obj)
        things.append(obj)
    for number in range(random.randint(0, 2)):
        made = _add(random, f"Light {number}", surfaces.lamp(random), center, scale)
        if made.data.type != "SUN":
            made.data.energy *= scale**2
            for attribute in ("size", "size_y", "shadow_soft_size"):
                if made.data.type != "AREA" and attribute != "shadow_soft_size":
                    continue
                setattr(made.data, attribute, getattr(made.data, attribute) * scale)
    if group.objects and random.random() < 0.9:
        for number in range(random.randint(1, 2)):
            instancer = _add(random, f"Instancer {number}", None, center, 1.0)
            instancer.instance_type, instancer.instance_collection = "COLLECTION", group
    bpy.context.scene.unit_settings.scale_length = random.choice((1.0, 1.0, 0.01))
    # While all show, or what is hidden would keep the matrix it never had.
    bpy.context.view_layer.update()
    for obj in things:
        _set_roles(random, obj)
    bpy.context.view_layer.update()
    return _settings(random)


def _painted(random: Random, data: bpy.types.ID, materials: list) -> bpy.types.ID:
    """Give a mesh, curve or metaball some of the materials."""
    for made in random.sample(materials, random.randint(0, len(materials))):
        data.materials.append(made)
    if isinstance(data, bpy.types.Mesh):
        # Now and then a slot that does not exist.
        slots = max(len(data.materials), 1) + (random.random() < 0.1)
        index = [random.randrange(slots) for _ in data.polygons]
        data.polygons.foreach_set("material_index", index)
    return data


def _add(
    random: Random,
    name: str,
    data: bpy.types.ID | None,
    center: Vector,
    scale: float,
    collection: bpy.types.Collection | None = None,
) -> bpy.types.Object:
    """Put an object somewhere near the center, turned, mirrored or stretched as it may be."""
    obj = bpy.data.objects.new(name, data)
    (collection or bpy.context.scene.collection).objects.link(obj)
    place = center + scale * Vector(random.uniform(-3, 3) for _ in range(3))
    turn = [random.choice((0.0, 0.0, random.uniform(0, 2 * math.pi))) for _ in range(3)]
    stretch = [random.choice((1.0, 1.0, -1.0, random.uniform(0.2, 2.0))) for _ in range(3)]
    if random.random() < 0.03:
        stretch[random.randrange(3)] = 0.0
    obj.matrix_world = Matrix.LocRotScale(place, None, None)
    obj.rotation_euler = turn
    obj.scale = [scale * each for each in stretch]
    return obj


def _set_roles(random: Random, obj: bpy.types.Object) -> None:
    obj.radiosity_mode = random.choices(("BAKE", "LIGHT_ONLY", "IGNORE"), (8, 1, 1))[0]
    obj.radiosity_texel_scale = random.choice((1.0, 1.0, 0.3, 4.0))
    for attribute, share in (
        ("visible_diffuse", 0.1),
        ("visible_shadow", 0.1),
        ("hide_render", 0.05),
        ("hide_viewport", 0.05),
    ):
        if random.random() < share:
            setattr(obj, attribute, not getattr(obj, attribute))


def _settings(random: Random) -> BakeSettings:
    """Draw settings that bake in a moment."""
    shared = random.random() < 0.8
    small = random.random() < 0.1
    return BakeSettings(
        resolution=random.choice((8, 16, 16, 24, 32)),
        atlas="shared" if shared else "per-object",
        pages=random.choice((1, 1, 2)) if shared else 1,
        mip_levels=random.choice((0, 0, 1)),
        quality="draft",
        quantity=random.choice(("irradiance", "irradiance", "irradiance_over_pi", "radiosity")),
        light=random.choice(("all", "all", "all", "direct", "indirect")),
        keep_uvs=random.random() < 0.3,
        sky=random.random() < 0.5,
        seed=random.randrange(1000),
        threads=1,
        # Coarser than a draft: what must hold holds at any number of elements.
        **({"method": random.choice(SMALL_METHODS)} if small else {"error": 0.01, "min_area": 1e-3}),
    )
