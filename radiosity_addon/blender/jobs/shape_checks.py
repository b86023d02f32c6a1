"""Faces in the same place as others, and objects that are inside out, found before a bake."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...bake import coincident_counts, of_coincident, of_inside_out
from ...base import BakeWarning
from ...scene import BakeObject, BakeScene, Scene
from ..apply.face_flips import found_faces
from ..datablocks.mesh_arrays import world_from_object
from ..scene_records.pieces import Piece, SceneContents
from ..session.turned_faces import TurnedFaces

MOST_SEARCHED = 500_000
"""Triangles that are searched for others in their place: it takes about 10 µs for each."""


def unlit_scene(collected: SceneContents, chosen: Sequence[Piece]) -> BakeScene | None:
    """Return a scene of the shapes that were collected, with means of what they emit; None if there are none.

    chosen: The pieces that get lightmaps.
    """
    pieces = [piece for piece in collected.pieces if len(piece.mesh)]
    if not pieces:
        return None
    named = {id(piece) for piece in chosen}
    objects, corners, in_bounces, in_shadows, first = [], [], [], [], 0
    for piece in pieces:
        mesh, size = piece.mesh, len(piece.mesh)
        objects.append(
            BakeObject(piece.source.name, first, size, id(piece) in named, mesh.polygon, mesh.loops)
        )
        corners.append(world_from_object(mesh, piece.matrix)[0])
        in_bounces.append(np.full(size, piece.role.in_bounces))
        in_shadows.append(np.full(size, piece.role.in_shadows))
        first += size
    surface = np.concatenate([piece.surface for piece in pieces])
    opaque = np.array([one.opacity == 1.0 for one in collected.surfaces])[surface]
    scene = Scene(
        np.concatenate(corners),
        np.zeros((first, 3)),
        np.array([one.emission for one in collected.surfaces])[surface],
        two_sided=True,
        lights=collected.lights,
        in_bounces=np.concatenate(in_bounces),
        in_shadows=np.concatenate(in_shadows) & opaque,
    )
    return BakeScene(scene, tuple(objects), cameras=tuple(collected.cameras))


def inside_out_warnings(bake_scene: BakeScene | None) -> Sequence[BakeWarning]:
    """Name the objects that are inside out."""
    return [] if bake_scene is None else of_inside_out(bake_scene)


def faces_of(
    warnings: Sequence[BakeWarning], bake_scene: BakeScene | None, collected: SceneContents
) -> tuple[TurnedFaces, ...]:
    """Return the faces that warnings of `unlit_scene` name."""
    sources = [piece.source for piece in collected.pieces if len(piece.mesh)]
    return () if bake_scene is None else found_faces(warnings, bake_scene.objects, sources)


def coincident_warnings(bake_scene: BakeScene | None) -> Iterator[BakeWarning]:
    """Name the objects that have faces in the same place as others."""
    objects = [] if bake_scene is None else [item for item in bake_scene.objects if item.bake]
    if bake_scene is None or not objects:
        return
    count = len(bake_scene.scene)
    if count > MOST_SEARCHED:
        yield BakeWarning(
            "scene",
            f"{count:,} triangles are too many to search here for faces in the same place as others: "
            "the bake's report names them",
        )
        return
    yield from of_coincident(coincident_counts(objects, bake_scene.scene))
