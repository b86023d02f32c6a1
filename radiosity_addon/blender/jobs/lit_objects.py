"""What gets texels of the objects to be baked, before anything is unwrapped, and how large it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...bake import LightmappedObject
from ...numerics import triangle_areas
from ...scene import sealed_backs
from ..datablocks.mesh_arrays import world_from_object
from ..scene_records.pieces import Piece, SceneContents

MANY_SIDES = 200_000
"""Of fewer sides all are counted: they need little."""


@dataclass(frozen=True)
class PieceShape:
    """A piece in the world: its area [m²] and the box around it (2, 3)."""

    area: float
    box: np.ndarray


def piece_shape(piece: Piece) -> PieceShape:
    """Return the shape of a piece with faces."""
    corners, _, _ = world_from_object(piece.mesh, piece.matrix)
    flat = corners.reshape(-1, 3)
    return PieceShape(float(triangle_areas(corners).sum()), np.stack([flat.min(axis=0), flat.max(axis=0)]))


def lit_objects(
    chosen: Sequence[Piece], shapes: Mapping[int, PieceShape], collected: SceneContents, keep_uvs: bool
) -> list[LightmappedObject]:
    """Return the objects that get a lightmap.

    shapes: Of the pieces with faces, by their `id`.
    """
    clear = _clear(collected)
    return [
        _lit_object(piece, shapes.get(id(piece)), clear, keep_uvs)
        for piece in chosen
        if not len(piece.mesh) or not clear[piece.surface].all()
    ]


def lit_sides(pieces: Sequence[Piece], collected: SceneContents) -> int:
    """Return about how many sides of pieces take part in the light: not the insides of closed solids."""
    pieces = [piece for piece in pieces if piece.role.in_bounces and len(piece.mesh)]
    sides = 2 * sum(len(piece.mesh) for piece in pieces)
    if sides < MANY_SIDES:
        return sides
    surface = np.concatenate([piece.surface for piece in pieces])
    opaque = np.array([one.opacity == 1.0 for one in collected.surfaces])[surface]
    emits = np.array([one.emission.any() for one in collected.surfaces])[surface]
    stops = np.repeat([piece.role.in_shadows for piece in pieces], [len(piece.mesh) for piece in pieces])
    corners = np.concatenate([_in_world(piece) for piece in pieces])
    return sides - int(sealed_backs(corners, opaque & stops, emits, collected.lights).sum())


def _in_world(piece: Piece) -> np.ndarray:
    return world_from_object(piece.mesh, piece.matrix)[0]


def glass_materials(collected: SceneContents) -> list[str]:
    """Return the names of the materials that are glass and nothing else."""
    clear = _clear(collected)
    shown = {row for piece in collected.pieces for row in np.unique(piece.surface[clear[piece.surface]])}
    return sorted({source.name for row in shown if (source := collected.materials[row]) is not None})


def _clear(collected: SceneContents) -> np.ndarray:
    """Return (s,) bool: the surfaces that are glass and nothing else."""
    return np.array([surface.is_clear for surface in collected.surfaces], dtype=bool)


def _lit_object(
    piece: Piece, shape: PieceShape | None, clear: np.ndarray, keep_uvs: bool
) -> LightmappedObject:
    matte = ~clear[piece.surface]
    area, box = (0.0, np.zeros((2, 3))) if shape is None else (shape.area, shape.box)
    if not matte.all():
        corners, _, _ = world_from_object(piece.mesh, piece.matrix)
        area = float(triangle_areas(corners[matte]).sum())
    return LightmappedObject(
        piece.source.name,
        int(matte.sum()),
        area,
        piece.role.texel_scale,
        box,
        keeps_uvs=keep_uvs and piece.has_lightmap_layer,
        page=piece.role.page,
    )
