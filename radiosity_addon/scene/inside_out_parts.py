"""Closed parts of objects that are inside out: their normals point inward, so nothing lights their fronts.

A part is what is connected of one object, and closed as in `closed_solids.py`. Normals rightly point inward
in two cases. A room has something in it: a lamp, a camera or another part as a whole. A cavity is in a solid.
"""

from __future__ import annotations

import numpy as np

from ..lights import AreaLight, PointLight, SpotLight
from ..numerics import Array, double_area_vectors
from .bake_scene import BakeScene
from .closed_solids import LEAST_VOLUME, boxes_of, closed_parts, places

EQUAL = 1e-3
"""Boxes are equal if they differ by less than this share of their size: copies are not in each other. Points
are in a part if those at this distance are: what lies on its surface is not."""

AROUND = np.array([(0.2, 0.5, 0.8), (-0.2, -0.5, -0.8)])
"""The directions of these: not along axes, nor surfaces as people build them."""

LOOKED_AT = 8
"""A part is in a solid if the places behind so many of its largest triangles are."""

PAIRS = 1 << 18
"""Points and triangles looked at together; of the things in a part's box the largest are looked at."""


def inside_out(bake_scene: BakeScene) -> Array:
    """Return (t,) bool: triangles of closed, opaque parts that do not shine and are inside out."""
    scene = bake_scene.scene
    found = np.zeros(len(scene), dtype=bool)
    if len(scene) == 0:
        return found
    opaque = scene.solid & ~scene.emission.any(axis=1)
    owner = np.repeat(np.arange(len(bake_scene.objects)), [item.count for item in bake_scene.objects])
    part, is_closed = closed_parts(places(scene.triangles, 2 * owner + opaque))
    count = len(is_closed)
    local = scene.triangles - scene.triangles.reshape(-1, 3).mean(axis=0)
    volume = np.bincount(part, np.einsum("tk,tk->t", local[:, 0], double_area_vectors(local)), count) / 6.0
    is_closed &= np.bincount(part, opaque, count) > 0
    is_closed &= abs(volume) > LEAST_VOLUME * np.bincount(part, scene.areas, count) ** 1.5
    inward = np.flatnonzero(is_closed & (volume < 0))
    if len(inward) == 0:
        return found
    boxes = boxes_of(scene.triangles, part, count)
    lamps = [light for light in scene.lights if isinstance(light, PointLight | SpotLight | AreaLight)]
    points = [*(light.position for light in lamps), *bake_scene.cameras]
    lone = np.array(points, dtype=np.float64).reshape(-1, 1, 3)
    things = np.concatenate([boxes, np.repeat(lone, 2, axis=1)])
    order = np.argsort(part, kind="stable")
    first = np.searchsorted(part[order], np.arange(count + 1))
    for number in inward:
        rows = order[first[number] : first[number + 1]]
        if _is_room(scene.triangles[rows], boxes[number], things):
            continue
        largest = rows[np.argsort(-scene.areas[rows], kind="stable")[:LOOKED_AT]]
        size = float(np.ptp(boxes[number], axis=0).max())
        behind = scene.triangles[largest].mean(axis=1) - EQUAL * size * scene.face_normals[largest]
        around = is_closed & (boxes[:, 0] < boxes[number, 0]).all(axis=1)
        around &= (boxes[:, 1] > boxes[number, 1]).all(axis=1)
        if not (_winding(scene.triangles[around[part]], behind) > 0.5).all():
            found[rows] = True
    return found


def _is_room(triangles: Array, box: Array, things: Array) -> bool:
    """Return whether a closed part has anything in it.

    things (n, 2, 3): Boxes around all that may be.
    """
    size = float(np.ptp(box, axis=0).max())
    inside = (things[:, 0] >= box[0]).all(axis=1) & (things[:, 1] <= box[1]).all(axis=1)
    inside &= (abs(things - box) > EQUAL * size).any(axis=(1, 2))
    things = things[inside]
    largest = np.argsort(-np.ptp(things, axis=1).sum(axis=1), kind="stable")
    middle = things[largest[: max(PAIRS // len(triangles), 1)]].mean(axis=1)
    around = middle[:, None] + EQUAL * size * AROUND
    turns = _winding(triangles, around.reshape(-1, 3)).reshape(-1, 2)
    return bool((turns < -0.5).all(axis=1).any())


def _winding(triangles: Array, points: Array) -> Array:
    """Return (n,) how often closed surfaces go around points: 1 in a solid, −1 in a room.

    The sum of solid angles over 4π (Van Oosterom and Strackee 1983).
    """
    total = np.zeros(len(points))
    step = max(PAIRS // max(len(points), 1), 1)
    for first in range(0, len(triangles), step):
        a, b, c = np.moveaxis(triangles[None, first : first + step] - points[:, None, None], 2, 0)
        length = [np.linalg.norm(side, axis=2) for side in (a, b, c)]
        below = length[0] * length[1] * length[2]
        for one, other, third in ((a, b, 2), (b, c, 0), (c, a, 1)):
            below += np.einsum("ntk,ntk->nt", one, other) * length[third]
        above = np.einsum("ntk,ntk->nt", a, np.cross(b, c))
        total += np.arctan2(above, below).sum(axis=1) / (2.0 * np.pi)
    return total
