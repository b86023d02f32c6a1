"""Linear elements: one unknown per vertex of the leaves' mesh, a hat around each (handout §3.1, §3.2.1).

Radiosity jumps at creases, and the kernel κ is discontinuous there. So faces share vertices
only across edges where nothing but they meet, coplanar and of one material; and the nodes at
the rim of such a patch are moved slightly into their face before the equation is evaluated there.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array, connected_components, numbered, weights_at
from ...scene import Faces
from ..hierarchy import Basis, Hierarchy

INWARD = 0.2
"""Nodes at the boundary move this part of the way to the centroid of an adjacent leaf."""

COPLANAR_COSINE = 1e-9
"""Faces whose normals' cosine is above 1 less this lie in one plane where they share an edge."""

ON_EDGE = 1e-9
"""A vertex whose barycentric weight is below this lies on the opposite edge of its face."""


def vertex_basis(hierarchy: Hierarchy) -> Basis:
    """Return hats over the leaves: one where a vertex is, falling to 0 at its neighbors.

    Where leaves of different size meet, the vertex on the larger one's edge has a hat on the
    smaller leaves only.
    """
    leaf = hierarchy.leaves
    corners = hierarchy.corners[leaf]
    position = numbered(corners.reshape(-1, 3) + 0.0)
    # First every face's own vertices, then those across smooth edges become one.
    node = numbered(np.stack([np.repeat(hierarchy.face[leaf], 3), position], axis=1))
    joined, at_crease = _across_edges(hierarchy, node, position)
    node, at_crease = joined[node], at_crease[node]

    angle = _angles(corners)
    around = np.bincount(node, angle.ravel())
    on_rim = (around < 2.0 * np.pi - 1e-6) | (np.bincount(node, at_crease) > 0)
    # Each node's home: the leaf with the widest angle there.
    order = np.lexsort((-angle.ravel(), node))
    first = order[np.flatnonzero(np.diff(node[order], prepend=-1))]
    inward = np.where(on_rim, INWARD / 3.0, 0.0)
    place = np.repeat(inward[:, None], 3, axis=1)
    place[np.arange(len(first)), first % 3] += 1.0 - 3.0 * inward
    return Basis(
        leaf=leaf,
        corner=node.reshape(-1, 3).astype(np.int32),
        home=first // 3,
        place=place,
        area=np.bincount(node, np.repeat(hierarchy.area[leaf] / 3.0, 3)),
    )


def _across_edges(hierarchy: Hierarchy, node: Array, position: Array) -> tuple[Array, Array]:
    """Join the nodes of faces along smooth edges.

    node, position (3 l,) int: The face's node and the place in space of every corner of every leaf.
    Returns joined (nodes,) int: A new number for every node, consecutive.
    Returns at_crease (nodes,) bool: Whether it lies on an edge of its face that is not smooth.
    """
    count = int(node.max(initial=-1)) + 1
    any_row = np.zeros(count, dtype=np.int64)
    any_row[node] = np.arange(len(node))
    leaf, face = hierarchy.leaves[any_row // 3], hierarchy.face[hierarchy.leaves[any_row // 3]]
    vertices = hierarchy.corners[leaf, any_row % 3]
    weights = weights_at(hierarchy.faces.corners[face], vertices[:, None])[:, 0]
    edge, smooth = _smooth_edges(hierarchy.faces)

    at_crease = np.zeros(count, dtype=bool)
    keys, nodes = [], []
    for opposite in range(3):
        on_edge = np.flatnonzero(weights[:, opposite] < ON_EDGE)
        side = (opposite + 1) % 3
        at_crease[on_edge] |= ~smooth[face[on_edge], side]
        shared = on_edge[smooth[face[on_edge], side]]
        keys.append(np.stack([edge[face[shared], side], position[any_row[shared]]], axis=1))
        nodes.append(shared)
    key, rows = numbered(np.concatenate(keys)), np.concatenate(nodes)
    order = np.argsort(key, kind="stable")
    pairs = np.flatnonzero(np.diff(key[order]) == 0)
    label = connected_components(count, rows[order[pairs]], rows[order[pairs + 1]])
    return numbered(label), at_crease


def _smooth_edges(faces: Faces) -> tuple[Array, Array]:
    """Find the edges where two coplanar faces of one material meet, and nothing else does.

    Returns edge (f, 3) int: The same number for the two faces of a smooth edge; edge k runs from corner k to
        k + 1.
    Returns smooth (f, 3) bool.
    """
    count = len(faces)
    ends = numbered(faces.corners.reshape(-1, 3) + 0.0).reshape(count, 3)
    ends = np.sort(np.stack([ends, np.roll(ends, -1, axis=1)], axis=-1), axis=-1)
    line = numbered(ends.reshape(-1, 2))
    owner = np.repeat(np.arange(count), 3)
    # Every triangle has a front: fronts count the triangles that meet at an edge.
    triangles = np.bincount(line, faces.front[owner], minlength=int(line.max(initial=-1)) + 1)
    # The two sides of a sheet are separate; a face belongs to the side of the first, or to neither.
    first = np.zeros(len(triangles), dtype=np.int64)
    first[line[::-1]] = owner[::-1]
    cosine = np.einsum("nk,nk->n", faces.normal[owner], faces.normal[first[line]])
    sheet = np.where(cosine > 1.0 - COPLANAR_COSINE, 0, np.where(cosine < COPLANAR_COSINE - 1.0, 1, 2))
    look = np.concatenate([faces.reflectance, faces.emission], axis=1)
    material = numbered(look)[owner]
    edge = numbered(np.stack([line, sheet, material], axis=1))
    meeting = np.bincount(edge)[edge]
    smooth = (triangles[line] == 2) & (sheet < 2) & (meeting == 2)
    return edge.reshape(count, 3), smooth.reshape(count, 3)


def _angles(corners: Array) -> Array:
    """Return (l, 3) the angles at the corners of triangles."""
    onward = np.roll(corners, -1, axis=1) - corners
    back = np.roll(corners, 1, axis=1) - corners
    across = np.linalg.norm(np.cross(onward, back), axis=2)
    return np.asarray(np.arctan2(across, np.einsum("lck,lck->lc", onward, back)))
