"""Give baked objects their lightmaps, without editing an original.

Each baked object gets a copy of its mesh with the UV layer `Lightmap` and lightmap
materials. What is shown but has no object with a mesh of its own to swap (an instance, or
an object that makes instances) is hidden, and stand-in objects take its place. All copies
are made before the first object is touched, so an error leaves the file as it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
from mathutils import Matrix

from ..bake_scene import BakedObject, BakeResult
from ..errors import BakeError
from ..settings import BakeSettings
from .bake_record import (
    made_datablocks,
    mark_made,
    record_hiding,
    record_mesh_swap,
    record_modifiers,
    recorded_objects,
    remove_datablocks,
)
from .export_sources import Export, ExportSource
from .group_images import GroupImages
from .light_shares import LightShares
from .lightmap_materials import LightmapMaterials
from .mesh_copies import copy_meshes, set_materials
from .restore import leave_edit_modes
from .uv_layers import check_room, write_layer

STAND_IN_COLLECTION = "Radiosity Lightmaps"


@dataclass(frozen=True)
class _Replacement:
    """What will be shown in a source's place.

    `stand_in`: a new object shows it; otherwise the source's own object does.
    `baked` is None for what is only shown anew because its instancer will be hidden.
    """

    source: ExportSource
    mesh: bpy.types.Mesh
    stand_in: bool
    baked: BakedObject | None


def apply_lightmaps(
    context: bpy.types.Context,
    export: Export,
    result: BakeResult,
    images: Sequence[bpy.types.Image],
    settings: BakeSettings,
    groups: GroupImages | None = None,
) -> None:
    """Show the lightmaps on the baked objects; `restore` undoes it.

    Parameters
    ----------
    context : Context
        Of the scene that was exported, unchanged since.
    export : Export
    result : BakeResult
        The bake of `export.bake_scene`.
    images : sequence of Image
        Parallel to `result.pages`, from `write_pages`.
    settings : BakeSettings
        The quantity decides what the materials do with a texel.
    groups : mapping of str to list of Image
        Those of each light group, parallel to `images`: then materials mix these.

    Raises
    ------
    SceneError
        If an object has no room for another UV layer.
    BakeError
        If the file is baked already, or an object changed since the export.
    """
    if recorded_objects():
        raise BakeError("the file shows an earlier bake: restore it before baking again")
    before = set(made_datablocks())
    try:
        replacements = _make_replacements(context, export, result)
        shares = LightShares(context.scene, images, groups, settings) if groups else None
        _dress(replacements, images, settings.quantity, shares)
    except BaseException:
        remove_datablocks([datablock for datablock in made_datablocks() if datablock not in before])
        raise
    _show(context, replacements)


def check_targets(export: Export) -> None:
    """Refuse before a bake what `apply_lightmaps` would refuse after it.

    Raises
    ------
    SceneError
        If an object to be baked has no room for another UV layer.
    """
    for source, target in zip(export.sources, export.bake_scene.objects, strict=True):
        obj = bpy.data.objects.get((source.object_name, None))
        if target.bake and obj is not None and isinstance(obj.data, bpy.types.Mesh):
            check_room(obj.data, source.object_name)


def _make_replacements(context: bpy.types.Context, export: Export, result: BakeResult) -> list[_Replacement]:
    """Copy the meshes of all that will be shown anew."""
    lightmaps = {id(baked.object): baked for baked in result.objects}
    pairs = [
        (source, lightmaps.get(id(target)))
        for source, target in zip(export.sources, export.bake_scene.objects, strict=True)
    ]
    hidden = _instancers_to_hide(pairs)
    shown = [
        (source, baked, _shown_by(source) in hidden)
        for source, baked in pairs
        if baked is not None or _shown_by(source) in hidden
    ]
    leave_edit_modes(context, _real_objects([source for source, _, _ in shown]))
    meshes = copy_meshes(context, [source for source, _, _ in shown])
    return [
        _Replacement(source, mesh, stand_in, baked)
        for (source, baked, stand_in), mesh in zip(shown, meshes, strict=True)
    ]


def _instancers_to_hide(pairs: Sequence[tuple[ExportSource, BakedObject | None]]) -> set[str]:
    """Names of the objects that make instances and will be hidden.

    These are the ones of which an instance, or which themselves, were baked. Whatever else
    such an object shows needs a stand-in too, baked or not.
    """
    return {
        _shown_by(source)
        for source, baked in pairs
        if baked is not None and (source.is_instance or source.makes_instances)
    }


def _shown_by(source: ExportSource) -> str:
    """Name of the object that must be visible for the source to be."""
    return source.instancer if source.is_instance else source.object_name


def _real_objects(sources: Sequence[ExportSource]) -> list[bpy.types.Object]:
    """The objects that show the sources."""
    names = dict.fromkeys(_shown_by(source) for source in sources)
    return [bpy.data.objects[name, None] for name in names if (name, None) in bpy.data.objects]


def _dress(
    replacements: Sequence[_Replacement],
    images: Sequence[bpy.types.Image],
    quantity: str,
    shares: LightShares | None,
) -> None:
    """Give the mesh copies their lightmap UVs and materials."""
    materials = LightmapMaterials(quantity, shares)
    for replacement in replacements:
        mesh, baked, name = replacement.mesh, replacement.baked, replacement.source.name
        mesh.name = f"{name} (Lightmap)"
        if baked is not None:
            pinned = len(mesh.uv_layers) == 0
            check_room(mesh, name)
            write_layer(mesh, baked.object.loops, baked.uv, name)
            # A mesh without slots is drawn grey; its lightmap needs a slot to sit in.
            drawn = list(mesh.materials) or [None]
            image = images[baked.page]
            groups = [shares.emission_group(replacement.source, each) if shares else "" for each in drawn]
            copies = [
                materials.copy_of(material, image, pinned, group)
                for material, group in zip(drawn, groups, strict=True)
            ]
            set_materials(mesh, copies)


def _show(context: bpy.types.Context, replacements: Sequence[_Replacement]) -> None:
    """Put the replacements into the scene, remembering what they replace."""
    collection = None
    hidden = set()
    for replacement in replacements:
        if not replacement.stand_in:
            _swap_mesh(replacement)
            continue
        if collection is None:
            collection = bpy.data.collections.new(STAND_IN_COLLECTION)
            mark_made(collection)
            context.scene.collection.children.link(collection)
        collection.objects.link(_new_stand_in(replacement))
        hidden |= _family(_shown_by(replacement.source))
    for name in sorted(hidden):
        obj = bpy.data.objects[name, None]
        record_hiding(obj)
        obj.hide_viewport = obj.hide_render = True
    context.view_layer.update()


def _family(name: str) -> set[str]:
    """Return an object's name, and those of the metaballs that melt into one surface with it."""
    if bpy.data.objects[name, None].type != "META":
        return {name}
    base = name.split(".")[0]
    balls = (obj for obj in bpy.data.objects if obj.type == "META" and obj.library is None)
    return {obj.name for obj in balls if obj.name.split(".")[0] == base}


def _swap_mesh(replacement: _Replacement) -> None:
    """Show a mesh copy on the source's own object."""
    obj = bpy.data.objects[replacement.source.object_name, None]
    record_mesh_swap(obj)
    if replacement.source.needs_evaluated_mesh:
        record_modifiers(obj)
        for modifier in obj.modifiers:
            modifier.show_viewport = modifier.show_render = False
    obj.data = replacement.mesh
    # The copy's slots hold the lightmap materials; a slot linked to the object keeps its own.
    for slot in obj.material_slots:
        slot.link = "DATA"


def _new_stand_in(replacement: _Replacement) -> bpy.types.Object:
    """Make an object that shows a mesh copy at the source's place."""
    mesh = replacement.mesh
    stand_in = bpy.data.objects.new(f"{replacement.source.name} (Lightmap)", mesh)
    mark_made(stand_in)
    world = Matrix(replacement.source.matrix_world)
    stand_in.matrix_world = world
    if not _nearly_equal(stand_in.matrix_basis, world):
        # Nested scales can shear, which an object's location, rotation and scale cannot:
        # the mesh takes it, and the object only keeps the mirroring that a mesh must not.
        mirror = Matrix.Scale(-1.0, 4) if world.determinant() < 0.0 else Matrix.Identity(4)
        mesh.transform(mirror @ world, shape_keys=True)
        stand_in.matrix_world = mirror
    return stand_in


def _nearly_equal(first: Matrix, second: Matrix) -> bool:
    """Whether two transforms agree to float32 rounding."""
    size = max(max(abs(value) for value in row) for row in second)
    return all(abs(first[i][j] - second[i][j]) <= 1e-5 * size for i in range(4) for j in range(4))
