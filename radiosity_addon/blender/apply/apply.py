"""Give baked objects their lightmaps: on their own meshes, or on stand-ins where that cannot be.

An object with a mesh of its own shows the lightmap on this mesh: it gets a UV layer `Lightmap` and lightmap
copies of the materials. An object that shares its mesh, or whose modifiers make other polygons, gets a copy
of the mesh. What has no object with a mesh to swap (an instance, or an object that makes instances) is
hidden, and stand-in objects take its place. Everything is prepared before the first object is touched, and
nothing yields after that: an error leaves the file as it was.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import bpy
from mathutils import Matrix

from ...bake.result import BakedObject, BakeResult
from ...base import BakeError, BakeWarning, drain
from ...options import BakeSettings
from ..datablocks.bake_record import made_datablocks, mark_made, remove_datablocks, unmark_made
from ..datablocks.edit_modes import leave_edit_modes
from ..datablocks.uv_layers import check_room
from ..images.group_images import GroupImages
from ..images.light_mixer import mixers
from ..material_copies.light_shares import LightShares
from ..material_copies.lightmap_materials import LightmapMaterials
from ..material_copies.material_slots import drawn_materials, empty_slots
from ..scene_records.export_sources import Export, ExportSource
from ..scene_records.scene_objects import copy_evaluated_meshes
from ..stand_ins.followers import left_behind, places
from ..stand_ins.replacements import Replacement, changed_objects, dress, show, shown_by
from ..stand_ins.stand_ins import StandIn, stand_in_of
from .rebake import EarlierBake, bare, replacing_earlier


def apply_lightmaps(
    context: bpy.types.Context,
    export: Export,
    result: BakeResult,
    images: Sequence[bpy.types.Image],
    settings: BakeSettings,
    groups: GroupImages | None = None,
    earlier: EarlierBake | None = None,
) -> tuple[BakeWarning, ...]:
    """Show the lightmaps on the baked objects, at once; see `apply_steps`.

    Without `earlier` all that the file shows of other bakes is replaced.
    """
    if earlier is None:
        with replacing_earlier(context) as replaced:
            return apply_lightmaps(context, export, result, images, settings, groups, replaced)
    return drain(apply_steps(context, export, result, images, settings, groups, earlier))


def apply_steps(
    context: bpy.types.Context,
    export: Export,
    result: BakeResult,
    images: Sequence[bpy.types.Image],
    settings: BakeSettings,
    groups: GroupImages | None,
    earlier: EarlierBake,
) -> Generator[float, None, tuple[BakeWarning, ...]]:
    """Show the lightmaps on the baked objects; `restore` takes them off.

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
    earlier : EarlierBake
        What is replaced. It puts back what was there if this fails.

    Yields
    ------
    fraction : float
        How much is prepared. After the last one everything is shown.

    Returns
    -------
    warnings : tuple of BakeWarning
        What does not look as it was baked.

    Raises
    ------
    SceneError
        If an object has no room for another UV layer.
    BakeError
        If an object changed since the export.
    """
    before = set(made_datablocks())
    try:
        replacements, shares, baked_at = _prepare(context, export, result, images, settings, groups, earlier)
        materials = LightmapMaterials(settings.quantity, shares)
        for number, replacement in enumerate(replacements):
            dress(replacement, images, materials, shares)
            yield (number + 1) / len(replacements)
        earlier.take_off(changed_objects(replacements))
        show(context, replacements)
        return (*materials.warnings, *left_behind(context, baked_at))
    except BaseException:
        earlier.show_again()
        remove_datablocks([block for block in made_datablocks() if block not in before])
        raise


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


def _prepare(
    context: bpy.types.Context,
    export: Export,
    result: BakeResult,
    images: Sequence[bpy.types.Image],
    settings: BakeSettings,
    groups: GroupImages | None,
    earlier: EarlierBake,
) -> tuple[list[Replacement], LightShares | None, dict[str, Matrix]]:
    """Find or make the meshes of all that will be shown, while the file is without any lightmaps.

    Also returns where the objects are then, by name.
    """
    lightmaps = {id(baked.object): baked for baked in result.objects}
    pairs = [
        (source, lightmaps.get(id(target)))
        for source, target in zip(export.sources, export.bake_scene.objects, strict=True)
    ]
    hidden = _instancers_to_hide(pairs)
    shown = []
    for source, baked in pairs:
        stand_in = earlier.stand_ins.get(f"{source.name} (Lightmap)")
        if baked is None and stand_in is not None and shown_by(source) in hidden and earlier.is_partial:
            earlier.let_stay(stand_in)
        elif baked is not None or shown_by(source) in hidden:
            shown.append((source, baked, shown_by(source) in hidden))
    leave_edit_modes(context, _real_objects([source for source, _, _ in shown]))
    with bare(context):
        baked_at = places(context)
        sources = [source for source, _, _ in shown if source.needs_evaluated_mesh]
        evaluated = copy_evaluated_meshes(context, sources)
        for mesh in evaluated.values():
            mark_made(mesh)
        own = _meshes_of_one_object([source for source, _, stand_in in shown if not stand_in])
        replacements = [
            _replacement(source, baked, stand_in, evaluated, own) for source, baked, stand_in in shown
        ]
        with _mixers_aside():
            shares = LightShares(context.scene, images, groups, settings) if groups else None
    return replacements, shares, baked_at


@contextmanager
def _mixers_aside() -> Iterator[None]:
    """Have a new mixer take the sliders over from the one that is shown."""
    earlier = mixers()
    for mixer in earlier:
        unmark_made(mixer)
    try:
        yield
    finally:
        for mixer in earlier:
            mark_made(mixer)


def _instancers_to_hide(pairs: Sequence[tuple[ExportSource, BakedObject | None]]) -> set[str]:
    """Names of the objects that make instances and will be hidden.

    These are the ones of which an instance, or which themselves, were baked. Whatever else
    such an object shows needs a stand-in too, baked or not.
    """
    return {
        shown_by(source)
        for source, baked in pairs
        if baked is not None and (source.is_instance or source.makes_instances)
    }


def _real_objects(sources: Sequence[ExportSource]) -> list[bpy.types.Object]:
    """The objects that show the sources."""
    names = dict.fromkeys(shown_by(source) for source in sources)
    return [bpy.data.objects[name, None] for name in names if (name, None) in bpy.data.objects]


def _meshes_of_one_object(sources: Sequence[ExportSource]) -> set[bpy.types.Mesh]:
    """Return the meshes that can carry a lightmap themselves: the file's own, used by one object alone."""
    objects = [bpy.data.objects.get((source.object_name, source.library)) for source in sources]
    found = {obj.data: obj for obj in objects if obj is not None and isinstance(obj.data, bpy.types.Mesh)}
    users = bpy.data.user_map(subset=list(found)) if found else {}
    return {
        mesh
        for mesh, obj in found.items()
        if mesh.library is None
        and mesh.override_library is None
        and obj.library is None
        and obj.override_library is None
        and {user for user in users[mesh] if not _stands_in(user)} == {obj}
    }


def _stands_in(user: bpy.types.ID) -> bool:
    return isinstance(user, bpy.types.Mesh) and stand_in_of(user) is not None


def _replacement(
    source: ExportSource,
    baked: BakedObject | None,
    stand_in: bool,
    evaluated: dict[str, bpy.types.Mesh],
    own: set[bpy.types.Mesh],
) -> Replacement:
    """Find or make the mesh of one source."""
    obj = bpy.data.objects.get((source.object_name, source.library))
    mesh = evaluated.get(source.name)
    if mesh is not None:
        known = StandIn()
        if obj is not None and not stand_in:
            flags = tuple((each.name, each.show_viewport, each.show_render) for each in obj.modifiers)
            known = StandIn(active_slot=obj.active_material_index, modifiers=flags)
        own_object = None if stand_in else obj
        stands_for = None if own_object is None else own_object.data
        made = Replacement(source, baked, stand_in, mesh, False, stands_for, known, list(mesh.materials))
        return _with_object_slots(made, own_object)
    if source.needs_evaluated_mesh or obj is None or obj.type != "MESH":
        raise BakeError(f"object '{source.name}' was removed or renamed while it was being baked: bake again")
    drawn = drawn_materials(obj)
    check_room(obj.data, source.name)
    if obj.data in own and not stand_in:
        made = Replacement(source, baked, False, obj.data, True, None, StandIn(), drawn)
        return _with_object_slots(made, obj)
    mesh = obj.data.copy()
    mark_made(mesh)
    known = StandIn(active_slot=obj.active_material_index)
    made = Replacement(source, baked, stand_in, mesh, False, None if stand_in else obj.data, known, drawn)
    return _with_object_slots(made, None if stand_in else obj)


def _with_object_slots(made: Replacement, obj: bpy.types.Object | None) -> Replacement:
    """Note which material slots are linked to the object, not its data, and which of them are empty."""
    if obj is None:
        return made
    own = tuple(number for number, slot in enumerate(obj.material_slots) if slot.link == "OBJECT")
    return replace(made, object_slots=own, empty_slots=frozenset(empty_slots(obj)))
