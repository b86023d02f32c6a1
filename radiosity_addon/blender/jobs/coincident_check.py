"""Faces in the same place as others, found before a bake."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...bake import coincident_counts, of_coincident
from ...base import BakeWarning
from ...scene import BakeObject, Scene
from ..datablocks.mesh_arrays import world_from_object
from ..scene_records.pieces import Piece

MOST_SEARCHED = 500_000
"""Triangles that are searched: it takes about 10 µs for each."""


def coincident_warnings(pieces: Sequence[Piece], chosen: Sequence[Piece]) -> Iterator[BakeWarning]:
    """Name the objects that have faces in the same place as others.

    pieces: All of the scene.
    chosen: Those that get lightmaps.
    """
    pieces = [piece for piece in pieces if len(piece.mesh)]
    count = sum(len(piece.mesh) for piece in pieces)
    if not chosen or not count:
        return
    if count > MOST_SEARCHED:
        yield BakeWarning(
            "scene",
            f"{count:,} triangles are too many to search here for faces in the same place as others: "
            "the bake's report names them",
        )
        return
    named = {id(piece) for piece in chosen}
    objects, corners, in_bounces, first = [], [], [], 0
    for piece in pieces:
        size = len(piece.mesh)
        if id(piece) in named:
            objects.append(
                BakeObject(piece.source.name, first, size, True, piece.mesh.polygon, piece.mesh.loops)
            )
        world, _, _ = world_from_object(piece.mesh, piece.matrix)
        corners.append(world)
        in_bounces.append(np.full(size, piece.role.in_bounces))
        first += size
    black = np.zeros((count, 3))
    scene = Scene(
        np.concatenate(corners), black, black, two_sided=True, in_bounces=np.concatenate(in_bounces)
    )
    yield from of_coincident(coincident_counts(objects, scene))
