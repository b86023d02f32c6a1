"""Levels of detail by name, as engines have them: `Rock_LOD0`, `Rock_LOD1` …; they share one lightmap.

The finest one is baked. The others are where it is, so that they would shade it: they neither light nor
block, and get its lightmap's coordinates (`bake/levels.py`).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

import numpy as np

from ...base import BakeWarning, SceneError
from ...scene import LevelOfDetail
from ..datablocks.mesh_arrays import all_finite, no_triangles, not_finite_message, world_from_object
from ..scene_records.object_roles import LIGHT_ONLY
from ..scene_records.pieces import CoarseLevel, Piece, SceneContents

_LEVEL = re.compile(r"^(?P<name>.+)[._]LOD[._]?(?P<number>\d+)(?P<copy>\.\d{3,})?$", re.IGNORECASE)
"""What Blender adds to the names of copies belongs to all of them."""


def level_in(name: str) -> tuple[str, int] | None:
    """Return what levels are of, by an object's name, and which one it is; None for other names."""
    found = _LEVEL.match(name)
    return None if found is None else (found["name"] + (found["copy"] or ""), int(found["number"]))


def share_levels(contents: SceneContents) -> None:
    """Have coarser levels show the lightmap of the finest one that gets one."""
    rows = [row for row, piece in enumerate(contents.pieces) if piece.bakeable and not _is_many(piece)]
    plain = {contents.pieces[row].source.object_name: row for row in rows}
    families: dict[str, list[tuple[int, int]]] = {}
    for row in rows:
        found = level_in(contents.pieces[row].source.object_name)
        if found is not None:
            families.setdefault(found[0], []).append((found[1], row))
    for name, levels in families.items():
        levels.sort()
        if levels[0][0] > 0 and name in plain:  # Rock, Rock_LOD1 …
            levels.insert(0, (0, plain[name]))
        finest, row = levels[0]
        base = contents.pieces[row]
        coarser = [row for number, row in levels[1:] if number > finest]
        for row in coarser:
            contents.pieces[row] = _coarser(contents.pieces[row], base, contents)
        if coarser:
            names = ", ".join(f"'{contents.pieces[row].source.name}'" for row in coarser)
            message = (
                f"{names} {'shows' if len(coarser) == 1 else 'show'} the lightmap of '{base.source.name}'"
            )
            said = BakeWarning(base.source.name, f"levels of detail by name: {message}", is_note=True)
            contents.warnings.append(said)


def levels_of(bases: Collection[str], names: Iterable[str]) -> list[str]:
    """Return the names that say they are of levels of detail of objects with other names."""
    families = {base if (found := level_in(base)) is None else found[0] for base in bases}
    return [
        name for name in names if (found := level_in(name)) and found[0] in families and name not in bases
    ]


def with_levels(chosen: Sequence[Piece], pieces: Sequence[Piece]) -> list[Piece]:
    """Return chosen pieces, and all coarser levels of them."""
    bases = {piece.source.name for piece in chosen}
    return [*chosen, *(piece for piece in pieces if piece.level is not None and piece.level.base in bases)]


def pieces_named(pieces: Sequence[Piece], name: str) -> list[Piece]:
    """Return the pieces that a user calls so; a coarser level stands for the finest one."""
    bases = {piece.level.base for piece in pieces if piece.level is not None and name in piece.names}
    return [piece for piece in pieces if name in piece.names or piece.source.name in bases]


def _is_many(piece: Piece) -> bool:
    return piece.source.is_instance or piece.source.makes_instances


def _coarser(piece: Piece, base: Piece, contents: SceneContents) -> Piece:
    """Return a level without triangles in the scene."""
    slots = np.maximum(piece.mesh.material, 0)
    glass = np.array([surface.is_clear for surface in contents.surfaces], dtype=bool)[piece.surface]
    only = frozenset(slots[glass].tolist()) - frozenset(slots[~glass].tolist())
    return replace(
        piece,
        source=replace(piece.source, glass_slots=only),
        mesh=no_triangles(),
        surface=piece.surface[:0],
        asked=frozenset(),
        inputs={},
        role=piece.role._replace(mode=LIGHT_ONLY),
        bakeable=False,
        level=CoarseLevel(base.source.name, base.matrix, piece.mesh),
    )


def level_of_detail(piece: Piece) -> LevelOfDetail | None:
    """Return a coarser level as arrays; None of other pieces.

    Raises SceneError if a coordinate is infinite.
    """
    level = piece.level
    if level is None:
        return None
    corners, _, mirrored = world_from_object(level.mesh, piece.matrix)
    if not all_finite(corners):
        raise SceneError(not_finite_message(piece.source.object_name))
    can_invert = abs(np.linalg.det(piece.matrix)) > 0.0  # not with a scale of 0
    to_base = level.matrix @ np.linalg.inv(piece.matrix) if can_invert else np.eye(4)
    order = slice(None, None, -1 if mirrored else 1)
    loops = np.ascontiguousarray(level.mesh.loops[:, order])
    return LevelOfDetail(level.base, corners, to_base, level.mesh.polygon, loops)
