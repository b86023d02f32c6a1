"""What gets texels of the objects to be baked, before anything is unwrapped: glass gets none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...bake import LightmappedObject
from ...numerics import triangle_areas
from ..datablocks.mesh_arrays import world_from_object
from ..scene_records.pieces import Piece, SceneContents


def lit_objects(
    chosen: Sequence[Piece],
    areas: Mapping[int, float],
    boxes: Mapping[int, np.ndarray],
    collected: SceneContents,
    keep_uvs: bool,
) -> list[LightmappedObject]:
    """Return the objects that get a lightmap.

    areas: The pieces' surfaces by their `id` [m²].
    boxes: Around the pieces (2, 3) by their `id` [m].
    """
    clear = _clear(collected)
    return [
        LightmappedObject(
            piece.source.name,
            int((~clear[piece.surface]).sum()),
            _matte_area(piece, areas.get(id(piece), 0.0), clear),
            piece.role.texel_scale,
            boxes.get(id(piece), np.zeros((2, 3))),
            keeps_uvs=keep_uvs and piece.has_lightmap_layer,
        )
        for piece in chosen
        if not len(piece.mesh) or not clear[piece.surface].all()
    ]


def glass_materials(collected: SceneContents) -> list[str]:
    """Return the names of the materials that are glass and nothing else."""
    clear = _clear(collected)
    shown = {row for piece in collected.pieces for row in np.unique(piece.surface[clear[piece.surface]])}
    return sorted({source.name for row in shown if (source := collected.materials[row]) is not None})


def _clear(collected: SceneContents) -> np.ndarray:
    """Return (s,) bool: the surfaces that are glass and nothing else."""
    return np.array([surface.is_clear for surface in collected.surfaces], dtype=bool)


def _matte_area(piece: Piece, area: float, clear: np.ndarray) -> float:
    """Return the surface [m²] of a piece, of which the given one includes its glass."""
    matte = ~clear[piece.surface]
    if matte.all():
        return area
    corners, _, _ = world_from_object(piece.mesh, piece.matrix)
    return float(triangle_areas(corners[matte]).sum())
