"""Flip faces that a bake or Check found to show their backs, on the user's own meshes.

Nothing is flipped that is another file's, or seen from its front elsewhere: it is refused with a reason.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import bpy

from ...base import BakeWarning
from ...scene import BakeObject
from ..datablocks.bake_record import is_made
from ..datablocks.edit_modes import leave_edit_modes
from ..datablocks.face_winding import flip_polygons, shape_digest
from ..material_copies.material_slots import original_of
from ..scene_records.export_sources import ExportSource
from ..session.turned_faces import TurnedFaces, runs_of
from ..stand_ins.stand_ins import own_mesh, record_shapes, stand_in_of

BLIND_TO_NORMALS = frozenset(
    {
        *("ARMATURE", "CAST", "CORRECTIVE_SMOOTH", "CURVE", "HOOK", "LAPLACIANDEFORM", "LAPLACIANSMOOTH"),
        *("LATTICE", "MESH_CACHE", "MESH_DEFORM", "SIMPLE_DEFORM", "SMOOTH", "SURFACE_DEFORM", "WARP"),
        *("DATA_TRANSFER", "NORMAL_EDIT", "UV_PROJECT", "UV_WARP", "WEIGHTED_NORMAL"),
        *("VERTEX_WEIGHT_EDIT", "VERTEX_WEIGHT_MIX", "VERTEX_WEIGHT_PROXIMITY"),
        *("ARRAY", "BEVEL", "EDGE_SPLIT", "MASK", "MIRROR", "SUBSURF", "TRIANGULATE"),
    }
)
"""Modifiers that make the same shape of flipped faces, flipped; Solidify and Displace, say, do not."""

SMOOTH_BY_ANGLE = "Smooth by Angle"
"""Blender's own node group of that name only marks edges."""


@dataclass(frozen=True)
class Flipped:
    """What was flipped.

    faces: Their number, each shared mesh's once.
    objects: Names of the objects that show them.
    refusals: Why other objects stay as they are, one line each.
    """

    faces: int
    objects: tuple[str, ...]
    refusals: tuple[str, ...]


def found_faces(
    warnings: Iterable[BakeWarning], objects: Sequence[BakeObject], sources: Sequence[ExportSource]
) -> tuple[TurnedFaces, ...]:
    """Return the faces that warnings name, by the file's objects.

    objects, sources: What was looked at, and where it came from; parallel.
    """
    turned = {warning.name: warning.turned for warning in warnings if warning.turned}
    shown: dict[str, list[tuple[BakeObject, ExportSource]]] = {}
    for item, source in zip(objects, sources, strict=True):
        if item.count:
            shown.setdefault(source.object_name, []).append((item, source))
    named = {source.object_name for item, source in zip(objects, sources, strict=True) if item.name in turned}
    found = []
    for name in sorted(named):
        places = shown[name]
        obj = bpy.data.objects.get((name, None))
        if obj is None:
            continue
        of_place = [set(turned.get(item.name, ())) for item, _ in places]
        everywhere = sorted(set.intersection(*of_place))
        polygons = everywhere or sorted(set.union(*of_place))
        mesh, item = own_mesh(obj), places[0][0]
        found.append(
            TurnedFaces(
                name,
                runs_of(polygons),
                is_whole=len(polygons) == len(set(item.polygon.tolist())),
                is_made=any(source.is_modified for _, source in places),
                is_right_elsewhere=not everywhere,
                shape=_shape_of(obj, mesh),
            )
        )
    return tuple(found)


def unchanged(found: Iterable[TurnedFaces]) -> tuple[list[TurnedFaces], list[str]]:
    """Return those of objects that are as they were, wherever they are, and the names of the others."""
    same, changed = [], []
    for faces in found:
        obj = bpy.data.objects.get((faces.object, None))
        mesh = None if obj is None else own_mesh(obj)
        if mesh is None:
            continue
        if faces.shape == _shape_of(obj, mesh):
            same.append(faces)
        else:
            changed.append(faces.object)
    return same, changed


def _shape_of(obj: bpy.types.Object, mesh: bpy.types.ID | None) -> str:
    """Return a digest of an object's mesh and of how it is turned; another one faces elsewhere."""
    if not isinstance(mesh, bpy.types.Mesh):
        return ""
    turned = " ".join(f"{round(value, 5) + 0.0:g}" for row in obj.matrix_world.to_3x3() for value in row)
    return f"{shape_digest(mesh)} {turned}"


def flip(context: bpy.types.Context, found: Sequence[TurnedFaces], chosen: Sequence[str]) -> Flipped:
    """Flip faces of meshes, and of what stands in for them.

    Edits made on stand-ins must have been carried (`edits.py`).

    found: Of all objects whose mesh is as it was.
    chosen: Names of the objects to flip; others turn along if they share a mesh with one.
    Raises BakeError if an object is being edited and cannot be switched to Object Mode.
    """
    by_object = {faces.object: faces for faces in found}
    users = _users({own_mesh(bpy.data.objects[name, None]) for name in by_object})
    refusals: list[str] = []
    done: dict[bpy.types.ID, list[bpy.types.Object]] = {}
    count = 0
    for name in chosen:
        mesh = own_mesh(bpy.data.objects[name, None])
        if mesh is None or mesh in done:
            continue
        sharing = users[mesh]
        reason = _refusal(name, sharing, by_object)
        if reason:
            refusals.append(reason)
            continue
        leave_edit_modes(context, sharing)
        # Where modifiers make other polygons, all of them are turned, or it was refused.
        is_made_by_any = any(by_object[obj.name].is_made for obj in sharing)
        polygons = None if is_made_by_any else _common(sharing, by_object)
        for shown in {mesh, *(obj.data for obj in sharing if is_made(obj.data))}:
            _flip(shown, polygons)
        done[mesh] = sharing
        count += len(mesh.polygons if polygons is None else polygons)
    names = sorted(obj.name for sharing in done.values() for obj in sharing)
    return Flipped(count, tuple(names), tuple(refusals))


def _users(meshes: set[bpy.types.ID]) -> dict[bpy.types.ID, list[bpy.types.Object]]:
    """Return the objects of the file whose own mesh each one is; not those that a bake made."""
    users: dict[bpy.types.ID, list[bpy.types.Object]] = {mesh: [] for mesh in meshes}
    for obj in bpy.data.objects:
        mesh = None if is_made(obj) else own_mesh(obj)
        if mesh in users:
            users[mesh].append(obj)
    return users


def _common(sharing: Sequence[bpy.types.Object], found: dict[str, TurnedFaces]) -> list[int]:
    """Return the polygons that are turned on all objects that share a mesh."""
    return sorted(set.intersection(*(set(found[obj.name].polygons) for obj in sharing)))


def _refusal(name: str, sharing: Sequence[bpy.types.Object], found: dict[str, TurnedFaces]) -> str:
    """Return why the faces of an object cannot be flipped; empty if they can."""
    obj = bpy.data.objects[name, None]
    mesh, other = own_mesh(obj), next((user for user in sharing if user.name not in found), None)
    if not isinstance(mesh, bpy.types.Mesh):
        return f"object '{name}' is no mesh: convert it (Object → Convert → Mesh) to flip its faces"
    if mesh.library is not None:
        path = mesh.library.filepath
        return f"object '{name}': its mesh is linked from '{path}': flip the faces there, or make it local"
    if mesh.override_library is not None:
        return f"object '{name}': its mesh is a library override: flip the faces in its library"
    if other is not None:
        return (
            f"object '{name}': '{other.name}' shares its mesh and was not found turned: give it a mesh of "
            "its own (Object → Relations → Make Single User)"
        )
    if any(found[user.name].is_right_elsewhere for user in sharing):
        return (
            f"object '{name}': an instance of it shows the front of its faces: make instances real "
            "(Object → Apply → Make Instances Real) and bake again"
        )
    if not _common(sharing, found):
        return (
            f"object '{name}': other faces are turned on an object that shares its mesh: give it a mesh of "
            "its own (Object → Relations → Make Single User)"
        )
    for user in sharing:
        sighted = next((each.name for each in user.modifiers if not _is_blind(each)), None)
        if sighted is not None:
            return (
                f"object '{name}': modifier '{sighted}' works differently on flipped faces: apply or remove "
                "it and bake again, or flip them in Edit Mode"
            )
    if any(found[user.name].is_made for user in sharing) and not all(
        found[user.name].is_whole for user in sharing
    ):
        return (
            f"object '{name}': its modifiers make the faces, and only some are turned: apply them and bake "
            "again, or flip them in Edit Mode"
        )
    return ""


def _is_blind(modifier: bpy.types.Modifier) -> bool:
    """Return whether a modifier makes the same shape of flipped faces."""
    if modifier.type == "NODES":
        group = modifier.node_group
        return group is None or group.name.startswith(SMOOTH_BY_ANGLE)
    return modifier.type in BLIND_TO_NORMALS


def _flip(mesh: bpy.types.Mesh, polygons: Sequence[int] | None) -> None:
    """Flip polygons of a mesh, None for all; have a stand-in know that this is no edit of the user's."""
    flip_polygons(mesh, range(len(mesh.polygons)) if polygons is None else polygons)
    known = stand_in_of(mesh)
    if known is not None:
        record_shapes(mesh, known.kind, [original_of(material) for material in mesh.materials], known)
