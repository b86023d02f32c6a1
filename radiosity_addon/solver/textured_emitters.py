"""Textured emission as lamps: faces cut up where their emission varies.

A face with an image of emission becomes pieces of constant emission. Shadow rays ask what share of a
lamp is seen, one number for all colours; so where pieces differ in colour each channel is a lamp
of its own, lest a red half of a screen be hidden by what stands before the green one.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array
from .emitters import EmitterGroup, end_offset
from .hierarchy import Faces, split_in_four
from .scene import WHOLE_TRIANGLE, Scene
from .surface_images import SurfaceImages
from .visibility import RayCaster

MOST_PIECES = 256
"""Of all textured faces together, if no more faces shine: every lit point asks every piece."""

SMOOTH = 0.002
"""A piece is cut no further when its emission varies by less than this share of all power."""

SAME_COLOUR = 1e-3
"""Pieces whose channels are in one proportion, to this much, are one lamp."""


def emitter_groups(
    scene: Scene, faces: Faces, caster: RayCaster, among: Array | None = None
) -> list[EmitterGroup]:
    """Return the emissive faces, if given those of a (f,) mask, as lamps, those of one colour together."""
    if scene.images is None:
        return EmitterGroup.of_faces(faces, caster, among)
    among = np.ones(len(faces), dtype=bool) if among is None else among
    textured = scene.images.textured[faces.triangle]
    plain = EmitterGroup.of_faces(faces, caster, ~textured & among)
    shines = textured & among & (faces.emission.max(axis=1, initial=0.0) > 0)
    return plain + _of_pieces(faces, *emissive_pieces(faces, np.flatnonzero(shines), scene.images), caster)


def emissive_pieces(faces: Faces, rows: Array, images: SurfaceImages) -> tuple[Array, Array, Array]:
    """Cut faces up where their emission varies.

    Parameters
    ----------
    rows : (f,) int
        Textured faces that shine.

    Returns
    -------
    face : (m,) int
    weights : (m, 3, 2) float64
        Each piece's corners, as weights of its triangle's second and third corner.
    emission : (m, 3) float64 [W/m²]
        Area means, multiplied by opacity.
    """
    face = rows
    weights = np.where(faces.front[rows, None, None], WHOLE_TRIANGLE, WHOLE_TRIANGLE[[0, 2, 1]])
    area = faces.area[rows]
    parts = _part_emissions(faces, face, weights, images)
    power = float(area @ parts.mean(axis=(1, 2)))
    while len(face) < MOST_PIECES:
        spread = area * np.abs(parts - parts.mean(axis=1, keepdims=True)).mean(axis=(1, 2))
        chosen = np.flatnonzero(spread > SMOOTH * power)
        if len(chosen) == 0:
            break
        room = max((MOST_PIECES - len(face)) // 3, 1)
        chosen = np.sort(chosen[np.argsort(-spread[chosen], kind="stable")[:room]])
        children = split_in_four(weights[chosen]).reshape(-1, 3, 2)
        of = np.repeat(face[chosen], 4)
        kept = np.delete(np.arange(len(face)), chosen)
        face = np.concatenate([face[kept], of])
        weights = np.concatenate([weights[kept], children])
        area = np.concatenate([area[kept], np.repeat(area[chosen] / 4, 4)])
        parts = np.concatenate([parts[kept], _part_emissions(faces, of, children, images)])
    return face, weights, parts.mean(axis=1)


def _part_emissions(faces: Faces, face: Array, weights: Array, images: SurfaceImages) -> Array:
    """Return (n, 16, 3) the mean emission of the sixteen parts of pieces."""
    parts = split_in_four(split_in_four(weights).reshape(-1, 3, 2)).reshape(-1, 3, 2)
    means = images.area_means(np.repeat(faces.triangle[face], 16), parts)
    return np.asarray(means[:, 3:6].reshape(-1, 16, 3))


def _of_pieces(
    faces: Faces, face: Array, weights: Array, emission: Array, caster: RayCaster
) -> list[EmitterGroup]:
    """Make lamps of pieces: one if all are of one colour, else one for each channel."""
    shines = emission.max(axis=1, initial=0.0) > 0
    face, weights, emission = face[shines], weights[shines], emission[shines]
    if len(face) == 0:
        return []
    corner = np.where(faces.front[face, None, None], faces.corners[face], faces.corners[face][:, [0, 2, 1]])
    corners = corner[:, :1] + np.einsum("pcw,pwk->pck", weights, corner[:, 1:] - corner[:, :1])
    brightest = emission.max(axis=1)
    colour = emission.sum(axis=0) / emission.sum(axis=0).max()
    if (np.abs(emission - brightest[:, None] * colour) <= SAME_COLOUR * brightest[:, None]).all():
        lamps = [(brightest, colour)]
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
