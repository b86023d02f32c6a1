"""What users do to a baked scene, and whether it is still there in the end.

An edit returns a check, which is run after Restore and returns what is wrong, or "". Objects with a mesh of
their own and no modifier must keep an edit as made. For all others it must be in the file, or a message
must have named the object.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random

import bpy

Check = Callable[[str], str]
"""Takes all that was said meanwhile."""

UNIQUE = 0.1234
"""Part of the values that edits set, by which they are found again."""


def edit(random: Random, own: set[str]) -> tuple[str, Check] | None:
    """Make one random edit to the open file; `own` are the objects whose mesh is theirs alone."""
    found = [obj for obj in bpy.context.scene.objects if obj.type == "MESH" and obj.library is None]
    found = [obj for obj in found if obj.name in EDITABLE and obj.data and obj.data.polygons]
    if not found:
        return None
    obj = random.choice(sorted(found, key=lambda each: each.name))
    kind = random.choice(KINDS)
    name = obj.name
    check = kind(random, obj, name in own)
    return None if check is None else (f"{kind.__name__.strip('_')} on {name!r}", check)


EDITABLE: set[str] = set()
"""Names of the objects that the scene had before the bake."""


def _move_vertex(random: Random, obj: bpy.types.Object, own: bool) -> Check:
    name, mark = obj.name, 5 + UNIQUE + random.randrange(1000)
    number = random.randrange(len(obj.data.vertices))
    obj.data.vertices[number].co.z = mark
    obj.data.update()

    def check(said: str) -> str:
        now = bpy.data.objects.get(name)
        if own:
            there = now is not None and number < len(now.data.vertices)
            return "" if there and _near(now.data.vertices[number].co.z, mark) else "the vertex moved back"
        anywhere = any(_near(vertex.co.z, mark) for mesh in bpy.data.meshes for vertex in mesh.vertices)
        return "" if anywhere or name in said else "the moved vertex is in no mesh, and nobody was told"

    return check


def _add_face(random: Random, obj: bpy.types.Object, own: bool) -> Check | None:
    if not own:
        return None
    import bmesh

    name, work = obj.name, bmesh.new()
    work.from_mesh(obj.data)
    work.faces.new([work.verts.new((random.random(), random.random(), 3 + i)) for i in range(3)])
    work.to_mesh(obj.data)
    work.free()
    count = len(obj.data.polygons)

    def check(said: str) -> str:
        return "" if len(bpy.data.objects[name].data.polygons) == count else "the new face is gone"

    return check


def _assign_material(random: Random, obj: bpy.types.Object, own: bool) -> Check | None:
    name = obj.name
    made = bpy.data.materials.new("New paint")
    title = made.name
    if not obj.material_slots:
        obj.data.materials.append(made)
        slot = 0
    else:
        slot = random.randrange(len(obj.material_slots))
        obj.material_slots[slot].material = made

    def check(said: str) -> str:
        slots = bpy.data.objects[name].material_slots
        now = slots[slot].material if slot < len(slots) else None
        if now is not None and now.name == title:
            return ""
        if not own and (name in said or any(title in mesh.materials for mesh in bpy.data.meshes)):
            return ""
        return f"the new material is gone: {now.name if now else None}"

    return check


def _paint(random: Random, obj: bpy.types.Object, own: bool) -> Check | None:
    """Change a base color where it is shown."""
    name, value = obj.name, UNIQUE + random.randrange(1, 8) / 10
    for number, slot in enumerate(obj.material_slots):
        tree = slot.material.node_tree if slot.material is not None else None
        for node in tree.nodes if tree is not None else ():
            if node.type not in ("BSDF_PRINCIPLED", "BSDF_DIFFUSE") or node.inputs[0].is_linked:
                continue
            title = node.name
            node.inputs[0].default_value = (value, value, value, 1)

            def check(said: str, number: int = number, title: str = title) -> str:
                now = _seen_in(bpy.data.objects[name], number)
                back = now.node_tree.nodes.get(title) if now is not None and now.node_tree else None
                there = back is not None and _near(back.inputs[0].default_value[0], value)
                return "" if there or name in said else "the base color is as it was"

            return check
    return None


def _seen_in(obj: bpy.types.Object, slot: int) -> bpy.types.Material | None:
    """Return the material of a slot; where the object's is empty, Blender shows the mesh's."""
    shown = obj.material_slots[slot].material if slot < len(obj.material_slots) else None
    return shown or (obj.data.materials[slot] if slot < len(obj.data.materials) else None)


def _copy_object(random: Random, obj: bpy.types.Object, own: bool) -> Check:
    """Alt-D, or Shift-D."""
    linked = random.random() < 0.6
    made = obj.copy()
    if not linked:
        made.data = obj.data.copy()
    bpy.context.scene.collection.objects.link(made)
    name, source, count = made.name, obj.name, len(made.data.polygons)
    # An empty slot shows a material of the bake meanwhile.
    shown = [slot.material.name if slot.material is not None else "" for slot in made.material_slots]
    filled = [bool(title) and not title.startswith("No Material (Lightmap)") for title in shown]

    def check(said: str) -> str:
        now = bpy.data.objects.get(name)
        if now is None:
            return f"the {'linked ' if linked else ''}copy is gone"
        if now.data is None or (own and len(now.data.polygons) != count):
            return "the copy has lost its mesh"
        beside = bpy.data.objects.get(source)
        if not linked and beside is not None and beside.data == now.data:
            return "the copy shares a mesh now"
        after = [slot.material is not None for slot in now.material_slots]
        if any(was and not is_now for was, is_now in zip(filled, after, strict=False)):
            return "the copy has lost a material"
        return ""

    return check


def _share_mesh(random: Random, obj: bpy.types.Object, own: bool) -> Check:
    """Use the mesh that is shown in an object that the bake does not know."""
    made = bpy.data.objects.new("Mine", obj.data)
    bpy.context.scene.collection.objects.link(made)
    name = made.name

    def check(said: str) -> str:
        now = bpy.data.objects.get(name)
        return "" if now is not None and now.data is not None else "the object that shares the mesh is gone"

    return check


def _transform(random: Random, obj: bpy.types.Object, own: bool) -> Check:
    name, mark = obj.name, 3 + UNIQUE + random.randrange(100)
    obj.location.x = mark

    def check(said: str) -> str:
        return "" if _near(bpy.data.objects[name].location.x, mark) else "it moved back"

    return check


def _delete(random: Random, obj: bpy.types.Object, own: bool) -> Check:
    name = obj.name
    EDITABLE.discard(name)
    bpy.data.objects.remove(obj)

    def check(said: str) -> str:
        return "" if bpy.data.objects.get(name) is None else "what was deleted is back"

    return check


def _add_modifier(random: Random, obj: bpy.types.Object, own: bool) -> Check:
    name = obj.name
    title = obj.modifiers.new("Mine", "SOLIDIFY").name

    def check(said: str) -> str:
        return "" if title in bpy.data.objects[name].modifiers else "the new modifier is gone"

    return check


def _add_uv_layer(random: Random, obj: bpy.types.Object, own: bool) -> Check | None:
    layer = obj.data.uv_layers.new(name="Mine") if own else None
    if layer is None:
        return None
    name, title = obj.name, layer.name

    def check(said: str) -> str:
        return "" if title in bpy.data.objects[name].data.uv_layers else "the new UV layer is gone"

    return check


def _link_elsewhere(random: Random, obj: bpy.types.Object, own: bool) -> Check:
    other = bpy.data.scenes.new("Mine")
    other.collection.objects.link(obj)
    name, title = obj.name, other.name

    def check(said: str) -> str:
        return "" if name in bpy.data.scenes[title].objects else "it is not in the other scene any more"

    return check


def _near(one: float, other: float) -> bool:
    return abs(one - other) < 1e-3


KINDS = (
    *(
        _move_vertex,
        _move_vertex,
        _add_face,
        _assign_material,
        _assign_material,
        _paint,
        _paint,
        _copy_object,
    ),
    *(_copy_object, _share_mesh, _transform, _delete, _add_modifier, _add_uv_layer, _link_elsewhere),
)
