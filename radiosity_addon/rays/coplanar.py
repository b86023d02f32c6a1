"""Coplanar surfaces back to back: which of them a ray meets.

The back of a one-sided triangle is black. Where another surface lies in it and faces the ray, that
one is in front, but Embree reports either, as rounding has it. So sides of which a black back may lie
in the same plane get a copy, moved out toward where they look: seen from there it comes first. The
triangle itself stays, so no gap opens next to it.
"""

from __future__ import annotations

import numpy as np

from ..numerics import Array, double_area_vectors, hash_keys

COPY_LIFT = 0.25
"""How far copies lie off their triangles, in units of the offset that rays start with: beyond the rounding of
hits, below the start of rays."""

MAX_TURN = 0.01
"""Normals of one plane differ by less than this, rounded corners of small triangles included, …"""

MAX_PLANE_DISTANCE = 128.0
"""… and their planes' distances from the scene's center by less than this, in units of the offset: about a
thousandth of the extent. Both are wide: what is only near a black back gets a copy that changes nothing."""

SHIFTS = (0.23, 0.71)
"""Values are rounded from two starts, so that no two near ones are parted by both."""


def facing_copies(triangles: Array, two_sided: Array, offset: float) -> tuple[Array, Array]:
    """Return copies of triangles that face away from black backs in their plane.

    triangles (t, 3, 3): Corners [m], the scene's center at the origin.
    two_sided (t,) bool: The others' backs are black.
    offset: How far above a surface its rays start [m].
    Returns rows (c,) int: Whose copies they are.
    Returns corners (c, 3, 3).
    """
    cross = double_area_vectors(triangles)
    double_area = np.linalg.norm(cross, axis=1)
    solid = np.flatnonzero(double_area > 0)
    normal = cross[solid] / double_area[solid, None]
    plane = np.empty((len(solid), 4))
    plane[:, :3] = normal / MAX_TURN
    plane[:, 3] = np.einsum("nk,nk->n", normal, triangles[solid, 0]) / (MAX_PLANE_DISTANCE * offset)
    backs = two_sided[solid]
    in_black = np.zeros((2, len(solid)), dtype=bool)
    for shift in SHIFTS:
        fronts_key, backs_key = _keys(plane + shift), _keys(shift - plane)
        black = np.unique(backs_key[~backs])
        in_black[0] |= np.isin(fronts_key, black)
        in_black[1] |= backs & np.isin(backs_key, black)
    out = COPY_LIFT * offset * normal[:, None]
    front, back = (np.flatnonzero(side) for side in in_black)
    corners = np.concatenate([triangles[solid[front]] + out[front], triangles[solid[back]] - out[back]])
    return np.concatenate([solid[front], solid[back]]), corners


def _keys(values: Array) -> Array:
    """Return (n,) one number for each row of (n, 4), the same for rows that are equal after rounding."""
    key: Array = np.zeros(len(values), dtype=np.uint32)
    for column in np.floor(values).astype(np.int64).T:
        key = hash_keys(column.astype(np.uint64) << np.uint64(32) | key, 71)
    return key
