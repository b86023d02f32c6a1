"""Textured emission as lamps: faces cut up where their emission varies.

A face with an image of emission becomes pieces of constant emission. Shadow rays ask what share of a
lamp is seen, one number for all colors; so where pieces differ in color each channel is a lamp
of its own, so that an object in front of the green half of a screen does not hide the red half.
"""

from __future__ import annotations

import numpy as np

from ...numerics import WHOLE_TRIANGLE, Array, areas, split_in_four
from ...rays import RayCaster
from ...scene import Faces, Scene, SurfaceImages
from .emitters import EmitterGroup, corners_of_parts, end_offset, upright

MAX_PIECES = 256
"""Of all textured faces together, if no more faces shine: every lit point asks every piece."""

SMOOTH = 0.002
"""A piece is cut no further when its emission varies by less than this share of all power."""

SAME_COLOR = 1e-3
"""Pieces whose channels are in one proportion, to this much, are one lamp."""


def emitter_groups(
    scene: Scene, faces: Faces, caster: RayCaster, among: Array | None = None
) -> list[EmitterGroup]:
    """Return the emissive faces, if given those of a (f,) mask, as lamps, those of one color together.

    Fronts and backs are apart: of a bulb one hides the other, and where shadow rays asked both, half of
    them would be blocked all around it, which is noise.
    """
    among = np.ones(len(faces), dtype=bool) if among is None else among
    sides = (among & faces.front, among & ~faces.front)
    return [group for side in sides for group in _of_side(scene, faces, caster, side)]


def _of_side(scene: Scene, faces: Faces, caster: RayCaster, among: Array) -> list[EmitterGroup]:
    """Return the emissive ones of some faces as lamps, those of one color together."""
    if scene.images is None:
        return EmitterGroup.of_faces(faces, caster, among)
    textured = scene.images.textured[faces.triangle]
    plain = EmitterGroup.of_faces(faces, caster, ~textured & among)
    shines = textured & among & (faces.emission.max(axis=1, initial=0.0) > 0)
    return plain + _of_pieces(faces, *emissive_pieces(faces, np.flatnonzero(shines), scene.images), caster)


def emissive_pieces(faces: Faces, rows: Array, images: SurfaceImages) -> tuple[Array, Array, Array]:
    """Cut faces up where their emission varies.

    rows (f,) int: Textured faces that shine.
    Returns face (m,) int.
    Returns weights (m, 3, 2): Each piece's corners, as weights of its triangle's second and third corner.
    Returns emission (m, 3) [W/m²]: Area means, multiplied by opacity.
    """
    if faces.own is None:
        face, level = rows, np.ones(len(rows))
        weights = np.broadcast_to(WHOLE_TRIANGLE, (len(rows), 3, 2))
        area = faces.area[rows]
    else:
        row, weights, level = faces.own.parts_of(faces.side[rows])
        face = rows[row]
        area = 2.0 * areas(weights) * faces.area[face]
    weights = upright(faces, face, weights)
    parts = _part_emissions(faces, face, weights, images) * level[:, None, None]
    power = float(area @ parts.mean(axis=(1, 2)))
    while len(face) < MAX_PIECES:
        spread = area * np.abs(parts - parts.mean(axis=1, keepdims=True)).mean(axis=(1, 2))
        chosen = np.flatnonzero(spread > SMOOTH * power)
        if len(chosen) == 0:
            break
        room = max((MAX_PIECES - len(face)) // 3, 1)
        chosen = np.sort(chosen[np.argsort(-spread[chosen], kind="stable")[:room]])
        children = split_in_four(weights[chosen]).reshape(-1, 3, 2)
        parent = np.repeat(face[chosen], 4)
        new = _part_emissions(faces, parent, children, images) * np.repeat(level[chosen], 4)[:, None, None]
        kept = np.delete(np.arange(len(face)), chosen)
        face = np.concatenate([face[kept], parent])
        level = np.concatenate([level[kept], np.repeat(level[chosen], 4)])
        weights = np.concatenate([weights[kept], children])
        area = np.concatenate([area[kept], np.repeat(area[chosen] / 4, 4)])
        parts = np.concatenate([parts[kept], new])
    return face, weights, parts.mean(axis=1)


def _part_emissions(faces: Faces, face: Array, weights: Array, images: SurfaceImages) -> Array:
    """Return (n, 16, 3) the mean emission of the sixteen parts of pieces."""
    parts = split_in_four(split_in_four(weights).reshape(-1, 3, 2)).reshape(-1, 3, 2)
    means = images.area_means(np.repeat(faces.triangle[face], 16), parts)
    return np.asarray(means[:, 3:6].reshape(-1, 16, 3))


def _of_pieces(
    faces: Faces, face: Array, weights: Array, emission: Array, caster: RayCaster
) -> list[EmitterGroup]:
    """Make lamps of pieces: one if all are of one color, else one for each channel."""
    shines = emission.max(axis=1, initial=0.0) > 0
    face, weights, emission = face[shines], weights[shines], emission[shines]
    if len(face) == 0:
        return []
    corners = corners_of_parts(faces, face, weights)
    brightest = emission.max(axis=1)
    color = emission.sum(axis=0) / emission.sum(axis=0).max()
    if (np.abs(emission - brightest[:, None] * color) <= SAME_COLOR * brightest[:, None]).all():
        lamps = [(brightest, color)]
    else:
        lamps = [(emission[:, channel], np.eye(3)[channel]) for channel in range(3)]
    return [
        EmitterGroup(
            corners[level > 0],
            faces.normal[face[level > 0]],
            strength,
            end_offset(caster),
            level[level > 0],
        )
        for level, strength in lamps
        if level.any()
    ]
