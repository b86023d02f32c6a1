"""Backs inside closed, opaque solids: half the sides of a furnished room, which no light reaches.

A surface is closed where its edges cancel: each is passed as often in one direction as in the other. Light
then enters what it encloses only through it. So if it is opaque, its normals point outward, and nothing that
shines is in the box around it, its backs stay dark.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights import AreaLight, Emitter, Lamp, Light, PointLight, SpotLight, each_lamp
from ..numerics import Array, connected_components, double_area_vectors

LEAST_VOLUME = 1e-9
"""Volumes below this share of area^1.5 are rounding: of sheets that are folded back on themselves."""

PAIRS = 1 << 22
"""Boxes compared with one another at a time."""


def sealed_backs(triangles: Array, solid: Array, emits: Array, lights: Sequence[Light]) -> Array:
    """Return (t,) bool: triangles whose backs no light reaches.

    triangles (t, 3, 3): Corners [m], counter-clockwise from the front.
    solid (t,) bool: Those that stop all light, on both sides.
    emits (t,) bool: Those that shine.
    lights: Lamps that are dark now may be lit later and count as well.
    """
    sealed = np.zeros(len(triangles), dtype=bool)
    rows = np.flatnonzero(solid & ~emits)
    shadowless = any(isinstance(light, Lamp) and not light.casts_shadow for light in lights)
    if len(rows) == 0 or shadowless:
        return sealed
    corners = triangles[rows]
    part, is_closed = closed_parts(places(corners))
    count = len(is_closed)
    local = corners - corners.reshape(-1, 3).mean(axis=0)
    vectors = double_area_vectors(local)
    volume = np.bincount(part, np.einsum("tk,tk->t", local[:, 0], vectors), count) / 6.0
    area = np.bincount(part, 0.5 * np.linalg.norm(vectors, axis=1), count)
    is_closed &= volume > LEAST_VOLUME * area**1.5
    kept = np.flatnonzero(is_closed[part])
    if len(kept) == 0:
        return sealed
    boxes = boxes_of(corners[kept], part[kept], count)
    shining = np.concatenate([_boxes_of_emitters(triangles[emits]), _boxes_of_lamps(lights)])
    is_closed &= ~_touched(boxes, shining)
    sealed[rows] = is_closed[part]
    return sealed


def places(corners: Array, apart: Array | None = None) -> Array:
    """Number the places of (t, 3, 3) corners exactly: (t, 3) int64.

    apart (t,) int: Corners of triangles with different numbers are in different places.
    """
    bits = (corners.reshape(-1, 3) + 0.0).view(np.uint64)  # 0 and −0 are one place
    key: Array = np.zeros(len(bits), dtype=np.uint64)
    if apart is not None:
        key += np.repeat(apart, 3).astype(np.uint64)
    for column in bits.T:
        # One number for three is several times as fast to sort; that two places share one is unlikely if all
        # bits of a coordinate count for all bits of it (SplitMix64): opposite places differ in signs alone.
        key ^= column
        for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
            key ^= key >> np.uint64(shift)
            key *= np.uint64(factor)
        key ^= key >> np.uint64(31)
    return np.unique(key, return_inverse=True)[1].reshape(-1, 3)


def closed_parts(places: Array) -> tuple[Array, Array]:
    """Return (t,) the part of the surface that each triangle is in, and (parts,) whether it is closed.

    places (t, 3) int: Of the corners. Parts go on where two triangles meet at an edge, not where more do:
    solids that touch are two.
    """
    count = len(places)
    forward, edges, first, length = _meeting_edges(places)
    pairs = first[length == 2]
    one, other = edges[pairs] // 3, edges[pairs + 1] // 3
    label = np.unique(connected_components(count, one, other), return_inverse=True)[1]
    parts = int(label.max()) + 1
    is_closed = np.ones(parts, dtype=bool)
    unequal = forward[edges[pairs]] == forward[edges[pairs + 1]]
    is_closed[label[one[unequal]]] = is_closed[label[other[unequal]]] = False
    # Where several solids touch, the edges of each cancel.
    rest = edges[np.repeat(length != 2, length)]
    if len(rest):
        number = np.repeat(np.arange(len(length)), length)[np.repeat(length != 2, length)]
        of_part = label[rest // 3]
        order = np.lexsort((of_part, number))
        number, of_part = number[order], of_part[order]
        begins = np.flatnonzero(np.diff(number, prepend=-1) | np.diff(of_part, prepend=-1))
        sums = np.add.reduceat(np.where(forward[rest][order], 1, -1), begins)
        is_closed[of_part[begins[sums != 0]]] = False
    return label, is_closed


def wound_parts(places: Array) -> Array:
    """Return (t,) the part of each triangle: parts end where neighbors face opposite ways.

    places (t, 3) int: Of the corners.
    """
    forward, edges, first, length = _meeting_edges(places)
    pairs = first[length == 2]
    pairs = pairs[forward[edges[pairs]] != forward[edges[pairs + 1]]]
    joined = connected_components(len(places), edges[pairs] // 3, edges[pairs + 1] // 3)
    return np.asarray(np.unique(joined, return_inverse=True)[1])


def _meeting_edges(places: Array) -> tuple[Array, Array, Array, Array]:
    """Return the edges of triangles (t, 3), sorted so that equal ones lie together.

    Returns forward (3 t,) bool: Whether each edge goes from the smaller to the larger place.
    Returns edges (e,) int: Their numbers; the triangle is a third.
    Returns first, length (k,) int: Where each run of equal ones starts, and how many they are.
    """
    start, end = places.ravel(), np.roll(places, -1, axis=1).ravel()
    forward = start < end
    key = np.where(forward, start, end) * (int(places.max()) + 1) + np.where(forward, end, start)
    # Edges of triangles without width that lead nowhere cancel by themselves.
    edges = np.flatnonzero(start != end)
    edges = edges[np.argsort(key[edges], kind="stable")]
    first = np.flatnonzero(np.diff(key[edges], prepend=-1))
    return forward, edges, first, np.diff(first, append=len(edges))


def boxes_of(corners: Array, group: Array, count: int) -> Array:
    """Return (count, 2, 3) boxes around groups of triangles; empty ones are inside out."""
    order = np.argsort(group, kind="stable")
    ordered = group[order]
    first = np.flatnonzero(np.diff(ordered, prepend=-1))
    boxes = np.empty((count, 2, 3))
    boxes[:, 0], boxes[:, 1] = np.inf, -np.inf
    boxes[ordered[first], 0] = np.minimum.reduceat(corners.min(axis=1)[order], first)
    boxes[ordered[first], 1] = np.maximum.reduceat(corners.max(axis=1)[order], first)
    return boxes


def _boxes_of_emitters(triangles: Array) -> Array:
    """Return (n, 2, 3) boxes around the connected parts of what shines."""
    if len(triangles) == 0:
        return np.zeros((0, 2, 3))
    part, is_closed = closed_parts(places(triangles))
    return boxes_of(triangles, part, len(is_closed))


def _boxes_of_lamps(lights: Sequence[Light]) -> Array:
    """Return (n, 2, 3) boxes around lamps in the scene."""
    boxes = np.zeros((0, 2, 3))
    for light in each_lamp(lights):
        if isinstance(light, PointLight | SpotLight):
            middle, reach = np.asarray(light.position), light.radius
        elif isinstance(light, AreaLight):
            middle = np.asarray(light.position)
            reach = 0.5 * float(np.linalg.norm(light.edge_u) + np.linalg.norm(light.edge_v))
        elif isinstance(light, Emitter):
            middle, reach = np.zeros(3), np.inf
        else:
            continue  # from outside of everything
        boxes = np.concatenate([boxes, np.stack([middle - reach, middle + reach])[None]])
    return boxes


def _touched(boxes: Array, others: Array) -> Array:
    """Return (n,) bool: the boxes that any of the others reaches into."""
    touched = np.zeros(len(boxes), dtype=bool)
    if len(others) == 0:
        return touched
    step = max(PAIRS // len(others), 1)
    for first in range(0, len(boxes), step):
        chunk = boxes[first : first + step, None]
        apart = (chunk[:, :, 0] > others[:, 1]) | (others[:, 0] > chunk[:, :, 1])
        touched[first : first + step] = (~apart.any(axis=2)).any(axis=1)
    return touched
