"""What a solved scene's links were, kept small, to be looked at: who lights an element, and how much."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ...lights import Light
from ...numerics import Array
from ..hierarchy import LEAF
from ..links import shared_means
from .state import SolverState


@dataclass(frozen=True, eq=False)
class LinkRecord:
    """Elements and links, as they were in the end.

    Nodes are numbered as in `Hierarchy`: clusters, then elements; lamps come after them.

    corners (e, 3, 3) float32: Of all elements, inner ones among them.
    parent (e,) int32: −1 for none.
    leaf (e,) bool.
    triangle (e,) int32: The scene's triangle that each is a part of, …
    front (e,) bool: … and on which side.
    cluster_center (c, 3) float32.
    cluster_above (c + f,) int32: The cluster that every cluster and face is in; −1 for none.
    lamp (m, 3) float32: Where lamps are; of those that shine from afar, the way to them, …
    afar (m,) bool: … which these are.
    receiver, source (l,) int32: Nodes.
    arriving (l,) float32 [W/m²]: What the link brings to the receiver on average, the mean of the channels.
    """

    corners: Array
    parent: Array
    leaf: Array
    triangle: Array
    front: Array
    cluster_center: Array
    cluster_above: Array
    lamp: Array
    afar: Array
    receiver: Array
    source: Array
    arriving: Array

    @property
    def nbytes(self) -> int:
        """Memory it takes."""
        return sum(int(getattr(self, entry.name).nbytes) for entry in fields(self))

    @property
    def n_clusters(self) -> int:
        """The node of element 0."""
        return len(self.cluster_center)

    def reaching(self, elements: Array) -> tuple[Array, Array, Array]:
        """Find the links that bring light to elements, their own and their ancestors'.

        elements (k,) int.
        Returns start, end (n, 3) float32: The receiver's and the source's middle. Links that are shared with
            ancestors start where the elements are.
        Returns arriving (n,) float32 [W/m²].
        """
        own = np.unique(elements)
        nodes = [own + self.n_clusters]
        above, face = own, own
        while len(above):
            face = np.concatenate([face[self.parent[face] == LEAF], above[self.parent[above] == LEAF]])
            above = np.unique(self.parent[above])
            above = above[above != LEAF]
            nodes.append(above + self.n_clusters)
        node = np.unique(face) + self.n_clusters
        while len(node):
            node = np.unique(self.cluster_above[node])
            node = node[node != LEAF]
            nodes.append(node)
        rows = np.flatnonzero(np.isin(self.receiver, np.concatenate(nodes)))
        center = self.corners[own].mean(axis=1)
        start = np.broadcast_to(center.mean(axis=0), (len(rows), 3)).copy()
        receiver = self.receiver[rows] - self.n_clusters
        place = np.searchsorted(own, receiver).clip(max=len(own) - 1)
        is_own = own[place] == receiver
        start[is_own] = center[place[is_own]]
        return start, self._middle(self.source[rows], start), self.arriving[rows]

    def _middle(self, node: Array, start: Array) -> Array:
        """Return (n, 3) where nodes are; what shines from afar is put a scene's width from `start`."""
        first_lamp = self.n_clusters + len(self.corners)
        middle = np.empty((len(node), 3), dtype=np.float32)
        cluster, lamp = node < self.n_clusters, node >= first_lamp
        element = ~cluster & ~lamp
        middle[cluster] = self.cluster_center[node[cluster]]
        middle[element] = self.corners[node[element] - self.n_clusters].mean(axis=1)
        middle[lamp] = self.lamp[node[lamp] - first_lamp]
        far = np.flatnonzero(lamp)[self.afar[node[lamp] - first_lamp]]
        size = float(np.ptp(self.corners.reshape(-1, 3), axis=0).max()) if len(self.corners) else 0.0
        middle[far] = start[far] + size * middle[far]
        return middle


def record_links(state: SolverState) -> LinkRecord:
    """Keep the elements and links of a solved state; methods without links have those from lamps alone."""
    hierarchy = state.hierarchy
    clusters, faces = hierarchy.clusters, hierarchy.faces
    sets = [getattr(state, "links", None), getattr(state, "cluster_links", None)]
    _, sent = shared_means(hierarchy, state.radiosity.mean(axis=1, keepdims=True))
    receiver, source, arriving = [], [], []
    for number, links in enumerate(sets):
        if links is None or len(links) == 0:
            continue
        receiver.append(links.receiver if number else links.receiver + hierarchy.n_clusters)
        source.append(links.source)
        arriving.append(links.factor * links.visibility * sent[links.source, 0])
    lights, strengths = state.light_links, np.array([light.strength.mean() for light in state.scene.lights])
    first_lamp = hierarchy.n_clusters + hierarchy.n_elements
    receiver.append(lights.receiver + hierarchy.n_clusters)
    source.append(lights.light + first_lamp)
    arriving.append(lights.mean_gain * strengths[lights.light] if len(lights) else np.zeros(0))
    above = np.full(hierarchy.n_clusters + len(faces), LEAF, dtype=np.int32)
    above[clusters.children.ravel()] = np.repeat(np.arange(len(clusters)), 2)
    lamps = [_place(light) for light in state.scene.lights]
    return LinkRecord(
        hierarchy.corners.astype(np.float32),
        hierarchy.parent.copy(),
        hierarchy.first_child == LEAF,
        faces.triangle[hierarchy.face],
        faces.front[hierarchy.face],
        clusters.center.astype(np.float32),
        above,
        np.array([place for place, _ in lamps], dtype=np.float32).reshape(-1, 3),
        np.array([afar for _, afar in lamps], dtype=bool),
        np.concatenate(receiver).astype(np.int32),
        np.concatenate(source).astype(np.int32),
        np.concatenate(arriving).astype(np.float32),
    )


def leaves_on(record: LinkRecord, triangles: Array) -> Array:
    """Return the leaf elements on the fronts of the scene's `triangles`."""
    return np.flatnonzero(record.leaf & record.front & np.isin(record.triangle, triangles))


def nearest_leaf(record: LinkRecord, point: Array) -> int | None:
    """Return the leaf element on a front that is nearest to a point (3,); None if there is none."""
    leaves = np.flatnonzero(record.leaf & record.front)
    if len(leaves) == 0:
        return None
    return int(leaves[_distance(record.corners[leaves].astype(np.float64), point).argmin()])


def _distance(corners: Array, point: Array) -> Array:
    """Return (n,) squared distances of a point from triangles (n, 3, 3): to their insides or edges."""
    edge = np.roll(corners, -1, axis=1) - corners
    apart = point - corners
    along = np.einsum("nck,nck->nc", apart, edge) / np.maximum(np.einsum("nck,nck->nc", edge, edge), 1e-300)
    to_edge = apart - np.clip(along, 0.0, 1.0)[:, :, None] * edge
    to_edges = np.einsum("nck,nck->nc", to_edge, to_edge).min(axis=1)
    normal = np.cross(edge[:, 0], edge[:, 1])
    square = np.maximum(np.einsum("nk,nk->n", normal, normal), 1e-300)
    above = np.einsum("nk,nk->n", apart[:, 0], normal) ** 2 / square
    inside = (np.einsum("nck,nck->nc", np.cross(edge, apart), normal[:, None]) >= 0).all(axis=1)
    return np.asarray(np.where(inside, above, to_edges))


def _place(light: Light) -> tuple[Array, bool]:
    """Return where a lamp is, or the way to it from anywhere and that it is afar; the sky is above."""
    position = getattr(light, "position", None)
    if position is not None:
        return np.asarray(position, dtype=np.float64), False
    direction = getattr(light, "direction", None)
    return (np.array([0.0, 0.0, 1.0]) if direction is None else -np.asarray(direction)), True
