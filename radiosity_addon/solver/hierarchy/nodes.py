"""The hierarchy's nodes: clusters above the faces, elements below (structure of arrays).

A *face* is one side of one triangle: the two sides receive, reflect and emit apart. Every
face is the root of a quadtree of *elements*, made by joining the midpoints of the edges;
its first element has the face's own index. *Clusters* group faces.

Nodes are numbered clusters first: node n < n_clusters is a cluster, node n ≥ n_clusters is
element n − n_clusters. So a link's source may be either and its receiver is an element.
"""

from __future__ import annotations

import numpy as np

from ...numerics import WHOLE_TRIANGLE, Array, split_in_four
from ...scene import Faces, Scene
from .clusters import Clusters, build_clusters

LEAF = -1

OPTICAL = ("reflectance", "emission", "opacity")


class Hierarchy:
    """Faces, the clusters above them and the elements below; grows as links need it.

    corners (e, 3, 3).
    face (e,) int32.
    parent, first_child (e,) int32: −1 for none. Four children are contiguous: three at the corners, one in
        the middle.
    level (e,) int32.
    area (e,) [m²].
    reflectance, emission (e, 3): Area means over each element, multiplied by opacity; emission in W/m².
    opacity (e,): Area means.
    roots (r,) int64: The nodes that together hold every face once; first links start from them.
    """

    STORED = (
        *("faces", "clusters", "roots", "face", "first_child", "level"),
        *("area", "reflectance", "emission", "opacity"),
    )

    def __init__(self, scene: Scene, left_out: Array | None = None) -> None:
        self.faces = Faces(scene, left_out)
        count = len(self.faces)
        # Of the faces themselves there is one copy, which both share (`subdivide`).
        self.corners = self.faces.corners
        self.face = np.arange(count, dtype=np.int32)
        self.parent = np.full(count, LEAF, dtype=np.int32)
        self.first_child = np.full(count, LEAF, dtype=np.int32)
        self.level = np.zeros(count, dtype=np.int32)
        self.area = self.faces.area
        self.reflectance: Array = self.faces.reflectance
        self.emission: Array = self.faces.emission
        self.opacity: Array = self.faces.opacity
        self._images = scene.images
        self._by_channel: Array | None = None
        self._plain = scene.reflectance, scene.emission, scene.opacity
        self._detailed = np.zeros(count, dtype=bool)
        """(f,) bool: faces whose elements differ: textured, or covered in part"""
        if self._images is not None:
            self._detailed |= self._images.textured[self.faces.triangle]
        if self.faces.own is not None:
            share = self.faces.own.share_of(self.faces.side)
            self._detailed |= (share > 0.0) & (share < 1.0)
        if self._detailed.any():
            # They become the means of their elements.
            for name in OPTICAL:
                setattr(self, name, getattr(self, name).copy())
            self._weights = np.zeros((0, 3, 2))
            """Corners of the elements below faces, as weights of the triangle's second and third corner."""
        emits = self.faces.emission.max(axis=1, initial=0.0) > 0
        # Emitters are grouped separately: averaged into a cluster of dark faces a small lamp is
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
        """(e,) float64: the divisor for radiosity at ray hits; never 0."""
        return np.where(self.opacity > 0, self.opacity, 1.0)

    @property
    def opacity_by_channel(self) -> Array:
        """(e, 1) float64: the opacity, or (e, 3) where there is glass, whose mean it is then."""
        if self._images is None or not self._images.tinting[self.faces.triangle].any():
            return self.opacity[:, None]
        if self._by_channel is None or len(self._by_channel) != self.n_elements:
            triangle = self.faces.triangle[self.face]
            rows = np.flatnonzero(self._images.tinting[triangle])
            stopped = 1.0 - self._images.mean_passes(triangle[rows], self._weights_of(rows))
            self._by_channel = np.repeat(self.opacity[:, None], 3, axis=1)
            # By the same mean as above: what others cover is no part of it.
            mean = np.maximum(stopped.mean(axis=1), 1e-300)
            self._by_channel[rows] = np.minimum(stopped * (self.opacity[rows] / mean)[:, None], 1.0)
        return self._by_channel

    def normal_of(self, elements: Array) -> Array:
        """Return (n, 3) float64: the unit normals of elements."""
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
        for name in OPTICAL:
            values = getattr(self, name)
            setattr(self, name, np.concatenate([values, np.repeat(values[elements], 4, axis=0)]))
        is_detailed = bool(self._detailed.any())
        if is_detailed:
            self._look_up(elements)
        for name in ("corners", "area") if is_detailed else ("corners", "area", *OPTICAL):
            setattr(self.faces, name, getattr(self, name)[: len(self.faces)])

    def _look_up(self, elements: Array) -> None:
        """Take the means over the new children of `elements`, and average them upward."""
        weights = split_in_four(self._weights_of(elements)).reshape(-1, 3, 2)
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

    def _weights_of(self, elements: Array) -> Array:
        """Return (n, 3, 2) the corners of elements, as weights of the triangle's second and third corner."""
        count = len(self.faces)
        front = self.faces.front[np.minimum(elements, count - 1)]
        weights = np.where(front[:, None, None], WHOLE_TRIANGLE, WHOLE_TRIANGLE[[0, 2, 1]])
        below = elements >= count
        weights[below] = self._weights[elements[below] - count]
        return weights

    def _means(self, elements: Array) -> Array:
        """Return (n, 7) reflectance, emission and opacity of elements, less the parts that others cover."""
        triangle, weights = self.faces.triangle[self.face[elements]], self._weights_of(elements)
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

        face (n,) int.
        barycentric (n, 2): Weights of the *triangle's* second and third corner, as ray casting gives them.
        Returns element (n,) int32.
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
