"""The hierarchy's nodes: clusters above the faces, elements below (structure of arrays).

A *face* is one side of one triangle: the two sides receive, reflect and emit apart. Every
face is the root of a quadtree of *elements*, made by joining the midpoints of the edges;
its first element has the face's own index. *Clusters* group faces.

Nodes are numbered clusters first: node n < n_clusters is a cluster, node n ≥ n_clusters is
element n − n_clusters. So a link's source may be either and its receiver is an element.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .arrays import Array
from .clusters import Clusters, build_clusters
from .scene import WHOLE_TRIANGLE, Scene

if TYPE_CHECKING:
    from .own_parts import OwnParts

LEAF = -1


class Faces:
    """The f sides of the scene's triangles that take part: fronts first, then backs.

    Triangles without area, or out of the bounces, have no faces. Backs exist where `two_sided`.
    """

    def __init__(self, scene: Scene) -> None:
        solid = np.flatnonzero((scene.areas > 0) & scene.in_bounces)
        backs = solid[scene.two_sided[solid]]
        self.triangle = np.concatenate([solid, backs]).astype(np.int32)
        """(f,) int32"""
        self.front = np.arange(len(self.triangle)) < len(solid)
        """(f,) bool"""
        corners = scene.triangles[self.triangle]
        corners[~self.front] = corners[~self.front][:, [0, 2, 1]]
        self.corners = corners
        """(f, 3, 3) float64, counter-clockwise as seen from the side's own half-space"""
        self.centre = corners.mean(axis=1)
        """(f, 3) float64: the centroids [m]"""
        sign = np.where(self.front, 1.0, -1.0)[:, None]
        self.normal = scene.face_normals[self.triangle] * sign
        """(f, 3) float64"""
        self.area = scene.areas[self.triangle]
        """(f,) float64 [m²]"""
        self.reflectance = scene.reflectance[self.triangle]
        """(f, 3) float64"""
        self.exitance = scene.emission[self.triangle]
        """(f, 3) float64 [W/m²]: what a face emits where nothing covers it"""
        self.emission = self.exitance
        """(f, 3) float64 [W/m²]"""
        self.opacity = scene.opacity[self.triangle]
        """(f,) float64: reflectance and emission are already multiplied by it. What other faces cover
        counts as cut out (`layers.py`)"""
        self.own: OwnParts | None = None
        """What covers leave of the scene's sides; None without any."""
        if scene.layers:
            self.own = scene.layers.own
            share = self.own.share_of(self.side)
            self.reflectance = self.reflectance * share[:, None]
            self.emission = self.exitance * share[:, None]
            self.opacity = self.opacity * share
        self.of_triangle = np.full((2, len(scene)), LEAF, dtype=np.int32)
        """(2, t) int32: the face of each triangle's front (row 0) and back (row 1), or −1"""
        self.of_triangle[0, solid] = np.arange(len(solid))
        self.of_triangle[1, backs] = np.arange(len(solid), len(self.triangle))

    def __len__(self) -> int:
        return len(self.triangle)

    @property
    def side(self) -> Array:
        """(f,) int: 2 t for the front of triangle t, 2 t + 1 for its back."""
        return np.asarray(2 * self.triangle.astype(np.int64) + ~self.front)


class Hierarchy:
    """Faces, the clusters above them and the elements below; grows as links ask for it.

    Attributes
    ----------
    corners : (e, 3, 3) float64
    face : (e,) int32
    parent, first_child : (e,) int32
        −1 for none. Four children are contiguous: three at the corners, one in the middle.
    level : (e,) int32
    area : (e,) float64 [m²]
    reflectance, emission : (e, 3) float64
        Area means over each element, multiplied by opacity; emission in W/m².
    opacity : (e,) float64
        Area means.
    """

    def __init__(self, scene: Scene) -> None:
        self.faces = Faces(scene)
        count = len(self.faces)
        self.corners = self.faces.corners.copy()
        self.face = np.arange(count, dtype=np.int32)
        self.parent = np.full(count, LEAF, dtype=np.int32)
        self.first_child = np.full(count, LEAF, dtype=np.int32)
        self.level = np.zeros(count, dtype=np.int32)
        self.area = self.faces.area.copy()
        self.reflectance: Array = self.faces.reflectance.copy()
        self.emission: Array = self.faces.emission.copy()
        self.opacity: Array = self.faces.opacity.copy()
        self._images = scene.images
        self._plain = scene.reflectance, scene.emission, scene.opacity
        self._detailed = np.zeros(count, dtype=bool)
        """(f,) bool: faces whose elements differ: textured, or covered in part"""
        if self._images is not None:
            self._detailed |= self._images.textured[self.faces.triangle]
        if self.faces.own is not None:
            share = self.faces.own.share_of(self.faces.side)
            self._detailed |= (share > 0.0) & (share < 1.0)
        if self._detailed.any():
            self._weights = np.where(
                self.faces.front[:, None, None], WHOLE_TRIANGLE, WHOLE_TRIANGLE[[0, 2, 1]]
            )
        emits = self.faces.emission.max(axis=1, initial=0.0) > 0
        # Emitters are grouped apart: averaged into a cluster of dark faces a small lamp is
        # missed by a few samples. So are backs: each lies where its front lies, unseen from
        # wherever the front is seen.
        self.clusters: Clusters
        self.roots: Array
        self.clusters, self.roots = build_clusters(
            self.faces,
            [
                np.flatnonzero(~emits & self.faces.front),
                np.flatnonzero(~emits & ~self.faces.front),
                np.flatnonzero(emits),
            ],
        )
        """roots: the nodes that together hold every face once; first links start from them"""

    @property
    def n_clusters(self) -> int:
        """Number of clusters, and the node of element 0."""
        return len(self.clusters)

    @property
    def n_elements(self) -> int:
        """Number of elements, inner ones included."""
        return len(self.face)

    @property
    def leaves(self) -> Array:
        """(l,) int: the elements without children; they tile all faces."""
        return np.flatnonzero(self.first_child == LEAF)

    @property
    def normal(self) -> Array:
        """(e, 3) float64: the unit normal of every element."""
        return np.asarray(self.faces.normal[self.face])

    @property
    def opacity_where_hit(self) -> Array:
        """(e,) float64: what to divide by for radiosity where a ray found a surface; never 0."""
        return np.where(self.opacity > 0, self.opacity, 1.0)

    def normal_of(self, elements: Array) -> Array:
        """Return (n, 3) float64: the unit normals of some elements."""
        return np.asarray(self.faces.normal[self.face[elements]])

    def subdivide(self, elements: Array) -> None:
        """Give four children to each of the distinct leaf `elements` (handout §4.2, Subdiv)."""
        if len(elements) == 0:
            return
        first = self.n_elements + 4 * np.arange(len(elements), dtype=np.int32)
        self.first_child[elements] = first
        self.corners = np.concatenate([self.corners, split_in_four(self.corners[elements]).reshape(-1, 3, 3)])
        self.face = np.concatenate([self.face, np.repeat(self.face[elements], 4)])
        self.parent = np.concatenate([self.parent, np.repeat(elements, 4).astype(np.int32)])
        self.first_child = np.concatenate([self.first_child, np.full(4 * len(elements), LEAF, np.int32)])
        self.level = np.concatenate([self.level, np.repeat(self.level[elements] + 1, 4).astype(np.int32)])
        self.area = np.concatenate([self.area, np.repeat(self.area[elements] / 4, 4)])
        for name in ("reflectance", "emission", "opacity"):
            values = getattr(self, name)
            setattr(self, name, np.concatenate([values, np.repeat(values[elements], 4, axis=0)]))
        if self._detailed.any():
            self._look_up(elements)

    def _look_up(self, elements: Array) -> None:
        """Take the means over the new children of `elements`, and average them upwards."""
        weights = split_in_four(self._weights[elements]).reshape(-1, 3, 2)
        self._weights = np.concatenate([self._weights, weights])
        above = elements[self._detailed[self.face[elements]]]
        rows = (self.first_child[above][:, None] + np.arange(4)).ravel()
        means = self._means(rows)
        self.reflectance[rows], self.emission[rows] = means[:, :3], means[:, 3:6]
        self.opacity[rows] = means[:, 6]
        # Samples of large elements are coarser than those of their parts.
        while len(above):
            children = self.first_child[above][:, None] + np.arange(4)
            for values in (self.reflectance, self.emission, self.opacity):
                values[above] = values[children].mean(axis=1)
            above = np.unique(self.parent[above])
            above = above[above != LEAF]

    def _means(self, elements: Array) -> Array:
        """Return (n, 7) reflectance, emission and opacity of elements, less what others cover."""
        triangle, weights = self.faces.triangle[self.face[elements]], self._weights[elements]
        if self._images is None:
            textured = np.zeros(len(elements), dtype=bool)
        else:
            textured = self._images.textured[triangle]
        means = np.empty((len(elements), 7))
        reflectance, emission, opacity = self._plain
        means[:, :3], means[:, 3:6], means[:, 6] = (
            reflectance[triangle],
            emission[triangle],
            opacity[triangle],
        )
        if self._images is not None:
            means[textured] = self._images.area_means(triangle[textured], weights[textured])
        if self.faces.own is not None:
            side = self.faces.side[self.face[elements]]
            back = side % 2 == 1
            upright = np.where(back[:, None, None], weights[:, [0, 2, 1]], weights)
            means *= self.faces.own.share_of_elements(side, upright)[:, None]
        return means

    def leaf_at(self, face: Array, barycentric: Array) -> Array:
        """Find the leaf element under points of faces.

        Parameters
        ----------
        face : (n,) int
        barycentric : (n, 2) float
            Weights of the *triangle's* second and third corner, as ray casting gives them.

        Returns
        -------
        element : (n,) int32
        """
        v = np.asarray(barycentric, dtype=np.float64)
        back = ~self.faces.front[face]
        second, third = np.where(back, v[:, 1], v[:, 0]), np.where(back, v[:, 0], v[:, 1])
        weights = np.stack([1.0 - second - third, second, third], axis=1)
        element = face.astype(np.int32)
        inner = np.flatnonzero(self.first_child[element] != LEAF)
        while len(inner):
            local = weights[inner]
            child = np.where(local.max(axis=1) >= 0.5, local.argmax(axis=1), 3)
            at_corner = 2.0 * local
            at_corner[np.arange(len(inner)), np.minimum(child, 2)] -= 1.0
            weights[inner] = np.where((child == 3)[:, None], 1.0 - 2.0 * local, at_corner)
            element[inner] = self.first_child[element[inner]] + child
            inner = inner[self.first_child[element[inner]] != LEAF]
        return element


def node_opacity(hierarchy: Hierarchy) -> Array:
    """Return (n_nodes,) float64: the area mean of the opacity of every cluster and element."""
    clusters, faces = hierarchy.clusters, hierarchy.faces
    if (faces.opacity == 1.0).all():
        return np.ones(hierarchy.n_clusters + hierarchy.n_elements)
    of_clusters = clusters.average(faces.opacity[:, None], faces.area)[:, 0]
    return np.concatenate([of_clusters, hierarchy.opacity])


def split_in_four(corners: Array) -> Array:
    """Join the midpoints of the edges of (n, 3, d) triangles.

    Returns
    -------
    children : (n, 4, 3, d)
        At corner 0, 1, 2, and the middle one; all oriented like their parent, of equal area.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    children = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab)]
    return np.stack([np.stack(child, axis=1) for child in children], axis=1)


def split_in_sixteen(corners: Array) -> Array:
    """Return (n, 16, 3, 3) the grandchildren of (n, 3, 3) triangles."""
    return split_in_four(split_in_four(corners).reshape(-1, 3, 3)).reshape(-1, 16, 3, 3)
