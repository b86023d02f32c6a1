"""Neighboring leaves on one smooth surface, which adaptive subdivision compares.

Two leaves are neighbors if they meet along an edge, within one face or across two coplanar
faces of the same side, and no wall stands on that edge.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array, weights_at
from ...rays import RayCaster
from .nodes import Hierarchy

ACROSS = 0.02
"""Distance beyond an edge's midpoint at which neighbors are searched, relative to the leaf's height."""

RISE = 4.0
"""Rays down to a coplanar face start this many surface offsets above the plane."""

COPLANAR_ANGLE = 1e-3
"""Coplanar faces' normals differ by less than this [radians]."""


def neighbors(hierarchy: Hierarchy, caster: RayCaster) -> Array:
    """Return (k, 2) int: the pairs of neighboring leaves, each once, the smaller number first.

    Every leaf looks across the middle of each of its edges. Where the leaf beyond is finer,
    its own look finds the pair; so all that share a whole edge of the smaller are found.
    """
    leaves = hierarchy.leaves
    leaf, inside, beyond = _probes(hierarchy, leaves)
    weights = weights_at(hierarchy.faces.corners[hierarchy.face[leaf]], beyond[:, None])[:, 0]
    found = np.full(len(leaf), -1, dtype=np.int64)
    same = weights.min(axis=1) >= 0
    found[same] = hierarchy.leaf_at(hierarchy.face[leaf[same]], _of_triangle(hierarchy, leaf, weights, same))
    out = np.flatnonzero(~same)
    found[out] = _across_faces(hierarchy, caster, leaf[out], beyond[out])

    rows = np.flatnonzero((found >= 0) & (found != leaf))
    rows = rows[_open(hierarchy, caster, leaf[rows], inside[rows], beyond[rows])]
    pairs = np.sort(np.stack([leaf[rows], found[rows]], axis=1), axis=1)
    return np.asarray(np.unique(pairs, axis=0))


def _probes(hierarchy: Hierarchy, leaves: Array) -> tuple[Array, Array, Array]:
    """Return (3l,) leaves and two (3l, 3): points slightly to either side of each edge's midpoint."""
    corners = hierarchy.corners[leaves]
    middle = 0.5 * (corners[:, [1, 2, 0]] + corners[:, [2, 0, 1]])
    outward = ACROSS * (middle - corners)
    shape = (-1, 3)
    return np.repeat(leaves, 3), (middle - outward).reshape(shape), (middle + outward).reshape(shape)


def _of_triangle(hierarchy: Hierarchy, leaf: Array, weights: Array, rows: Array) -> Array:
    """Return (m, 2) weights of the triangle's second and third corner, which backs see swapped."""
    front = hierarchy.faces.front[hierarchy.face[leaf[rows]]]
    chosen = weights[rows]
    return np.where(front[:, None], chosen[:, 1:], chosen[:, :0:-1])


def _across_faces(hierarchy: Hierarchy, caster: RayCaster, leaf: Array, points: Array) -> Array:
    """Return (n,) the leaf of a coplanar face at points beyond a leaf's own face, −1 for none."""
    faces = hierarchy.faces
    normal = hierarchy.normal[leaf]
    rise = RISE * caster.surface_offset
    hits = caster.intersect(points + rise * normal, -normal)
    face = faces.of_triangle[(~hits.front).astype(np.int8), hits.triangle]
    level = np.abs(hits.distance - rise) < 0.5 * rise
    found = (hits.triangle >= 0) & (face >= 0) & level
    found[found] = np.einsum("nk,nk->n", faces.normal[face[found]], normal[found]) > np.cos(COPLANAR_ANGLE)
    result = np.full(len(leaf), -1, dtype=np.int64)
    result[found] = hierarchy.leaf_at(face[found], hits.barycentric[found])
    return result


def _open(hierarchy: Hierarchy, caster: RayCaster, leaf: Array, inside: Array, beyond: Array) -> Array:
    """Return (n,) whether nothing stands between points on both sides of leaves' edges."""
    lift = caster.surface_offset * hierarchy.normal[leaf]
    along = beyond - inside
    distance = np.linalg.norm(along, axis=1)
    return caster.unoccluded(inside + lift, along / np.maximum(distance, 1e-300)[:, None], distance)
