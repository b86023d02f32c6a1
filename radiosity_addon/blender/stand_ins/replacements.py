"""What is shown of baked objects: their own meshes, or stand-ins, dressed in lightmap materials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import bpy
from mathutils import Matrix

from ...bake.result import BakedObject
from ...base import BakeError
from ..datablocks.bake_record import ORIGINAL, mark_made, record_baked, record_hiding, record_modifiers
from ..datablocks.uv_layers import check_room, layer_record, put_layer_on, set_record
from ..material_copies.light_shares import LightShares
from ..material_copies.lightmap_materials import LightmapMaterials
from ..material_copies.material_slots import set_materials
from ..scene_records.export_sources import ExportSource
from .followers import nearly_equal
from .mesh_digest import digest_of_mesh
from .stand_in_names import note_names
from .stand_ins import EVALUATED, OWN, StandIn, record_object, record_shapes, set_stand_in, stand_in_of

STAND_IN_COLLECTION = "Radiosity Lightmaps"

Materials = list[bpy.types.Material | None]


@dataclass(eq=False)
class Replacement:
    """What will be shown of a source.

    Attributes
    ----------
    source : ExportSource
    baked : BakedObject or None
        None for what is only shown again because its instancer will be hidden.
    stand_in : bool
        A new object shows it; otherwise the source's own object does.
    mesh : Mesh
        The user's own, or a stand-in.
    in_place : bool
        It is the user's own.
    own : Mesh or None
        What a stand-in mesh stands for.
    known : StandIn
        How the object was.
    object_slots : tuple of int
        Slots that are linked to the object.
    empty_slots : frozenset of int
        Those of them that are empty and show the mesh's material.
    drawn : list of Material
        What is in the slots without a bake.
    copies : list of Material
        Their lightmap copies.
    """

    source: ExportSource
    baked: BakedObject | None
    stand_in: bool
    mesh: bpy.types.Mesh
    in_place: bool
    own: bpy.types.Mesh | None
    known: StandIn
    drawn: Materials
    object_slots: tuple[int, ...] = ()
    empty_slots: frozenset[int] = frozenset()
    copies: Materials = field(default_factory=list)

    @property
    def obj(self) -> bpy.types.Object | None:
        """The source's own object."""
        return bpy.data.objects.get((self.source.object_name, self.source.library))


def dress(
    replacement: Replacement,
    images: Sequence[bpy.types.Image],
    materials: LightmapMaterials,
    shares: LightShares | None,
) -> None:
    """Make the materials of a replacement, and all of a stand-in mesh."""
    mesh, baked, source = replacement.mesh, replacement.baked, replacement.source
    if baked is not None:
        # Without slots a mesh is drawn gray; its lightmap needs a slot to sit in.
        drawn = replacement.drawn or [None]
        record = layer_record(mesh)
        pinned = len(mesh.uv_layers) == (0 if record is None or not record.ours else 1)
        image = images[baked.page]
        groups = [shares.emission_group(source, each) if shares else "" for each in drawn]
        replacement.copies = [
            material
            if slot in source.glass_slots
            else materials.copy_of(material, image, pinned, group, slot in replacement.empty_slots)
            for slot, (material, group) in enumerate(zip(drawn, groups, strict=True))
        ]
    if replacement.in_place:
        return
    mesh.name = f"{source.name} (Lightmap)"
    if baked is not None:
        check_room(mesh, source.name)
        put_layer_on(mesh, baked.loops, baked.uv, source.name)
    _fill_stand_in(replacement)


def _fill_stand_in(replacement: Replacement) -> None:
    """Fill the slots of a stand-in mesh, and have it know what it stands for."""
    mesh, own = replacement.mesh, replacement.own
    copies, stands_for = list(replacement.copies or replacement.drawn), list(replacement.drawn)
    kind = EVALUATED if replacement.source.needs_evaluated_mesh or replacement.stand_in else OWN
    if own is not None:
        mesh[ORIGINAL] = own
        # As many slots as the object has, or it would lose those that are linked to it.
        copies += copies[-1:] * (len(own.materials) - max(len(copies), len(mesh.materials)))
        stands_for += [None] * (len(copies) - len(stands_for))
        for slot in replacement.object_slots:
            if slot < min(len(own.materials), len(copies)):
                # Not to be seen: the object's slot has the copy.
                copies[slot] = stands_for[slot] = own.materials[slot]
    set_materials(mesh, copies)
    stands_for += [None] * (len(mesh.materials) - len(stands_for))
    record_shapes(mesh, kind, stands_for, replacement.known)


def shown_by(source: ExportSource) -> str:
    """Name of the object that must be visible for the source to be."""
    return source.instancer if source.is_instance else source.object_name


def changed_objects(replacements: Sequence[Replacement]) -> list[bpy.types.Object]:
    """Return the objects of the user's that will show something else, or be hidden."""
    names: dict[str, None] = {}
    for replacement in replacements:
        names.update(dict.fromkeys(sorted(_family(shown_by(replacement.source)))))
    return [bpy.data.objects[name, None] for name in names if (name, None) in bpy.data.objects]


def show(context: bpy.types.Context, replacements: Sequence[Replacement]) -> None:
    """Put the replacements into the scene, remembering what they replace."""
    collection = None
    hidden = set()
    for replacement in replacements:
        if replacement.stand_in:
            if collection is None:
                collection = bpy.data.collections.new(STAND_IN_COLLECTION)
                mark_made(collection)
                context.scene.collection.children.link(collection)
            collection.objects.link(_new_stand_in(replacement))
            hidden |= _family(shown_by(replacement.source))
            continue
        obj = replacement.obj
        if obj is None:
            name = replacement.source.name
            raise BakeError(f"object '{name}' was removed or renamed while it was being baked: bake again")
        record_baked(obj, context.scene)
        if replacement.in_place:
            _show_in_place(obj, replacement)
        else:
            _swap_mesh(obj, replacement)
    for name in sorted(hidden):
        obj = bpy.data.objects[name, None]
        record_hiding(obj, context.scene)
        obj.hide_viewport = obj.hide_render = True
    context.view_layer.update()


def _family(name: str) -> set[str]:
    """Return an object's name, and those of the metaballs that melt into one surface with it."""
    obj = bpy.data.objects.get((name, None))
    if obj is None or obj.type != "META":
        return {name}
    base = name.split(".")[0]
    balls = (obj for obj in bpy.data.objects if obj.type == "META" and obj.library is None)
    return {obj.name for obj in balls if obj.name.split(".")[0] == base}


def _show_in_place(obj: bpy.types.Object, replacement: Replacement) -> None:
    """Show a lightmap on the object's own mesh."""
    mesh, baked, copies = replacement.mesh, replacement.baked, replacement.copies
    if obj.data != mesh or baked is None:
        raise BakeError(f"object '{obj.name}' changed while it was being baked: bake again")
    put_layer_on(mesh, baked.loops, baked.uv, obj.name)
    if not mesh.materials:
        mesh.materials.append(copies[0])
        record = layer_record(mesh)
        if record is not None:
            set_record(mesh, replace(record, slots=1))
        return
    for slot, copy in zip(obj.material_slots, copies, strict=False):
        slot.material = copy


def _swap_mesh(obj: bpy.types.Object, replacement: Replacement) -> None:
    """Show a stand-in mesh on the source's own object."""
    if replacement.source.needs_evaluated_mesh:
        record_modifiers(obj)
        for modifier in obj.modifiers:
            modifier.show_viewport = modifier.show_render = False
    obj.data = replacement.mesh
    for slot, copy in zip(obj.material_slots, replacement.copies, strict=False):
        if slot.link == "OBJECT":
            slot.material = copy
    note_names(replacement.mesh, obj)


def _new_stand_in(replacement: Replacement) -> bpy.types.Object:
    """Make an object that shows a mesh copy at the source's place."""
    mesh = replacement.mesh
    stand_in = bpy.data.objects.new(f"{replacement.source.name} (Lightmap)", mesh)
    mark_made(stand_in)
    world = Matrix(replacement.source.matrix_world)
    stand_in.matrix_world = world
    if not nearly_equal(stand_in.matrix_basis, world):
        # Nested scales can shear, which an object's location, rotation and scale cannot:
        # the mesh takes it, and the object only keeps the mirroring that a mesh must not.
        mirror = Matrix.Scale(-1.0, 4) if world.determinant() < 0.0 else Matrix.Identity(4)
        mesh.transform(mirror @ world, shape_keys=True)
        stand_in.matrix_world = mirror
        known = stand_in_of(mesh)
        if known is not None:
            set_stand_in(mesh, replace(known, seal=digest_of_mesh(mesh)))
    instancer = bpy.data.objects.get((shown_by(replacement.source), None))
    record_object(stand_in, instancer, replacement.source.name)
    return stand_in
