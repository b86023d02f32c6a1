"""Let every leaf send out what it has: no more, no less.

Links of different levels do not add up at a leaf. It has fine links of its own to what is
near and shares its ancestors' coarse links to what is far; in a corner the own ones are
strong and the shared ones then too strong. The face's mean is exact, a leaf's sum may be a
quarter off, and as such leaves are also brighter or darker than the rest of their face,
power is made or lost, more with every bounce (6 % at a reflectance of 0.9).

So rays find what share of each leaf's light arrives anywhere at all, in a closed scene
simply all of it. What the leaf's own links leave of that is what it sends over shared ones:
its radiosity is scaled when they take their mean. Where its own links alone send more than
it has (faces that lie in one another are all hit), those are scaled too: so no leaf ever
sends more than it has, and the iteration converges whatever the scene.

What a leaf receives is the same the other way round: where nothing escapes ΣFV = 1, and what its own links
leave of that is what it receives over shared ones. A face that is its own leaf has all its light scaled, as
links to clusters miss what is curved within them. Both balances are struck in turn (Sinkhorn 1964), and
before them visibilities that few rays estimate are corrected (`known_sums`). The links as measured stay
as they are: what they alone add up to is reported too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import Array
from .cluster_links import ClusterLinks
from .hierarchy import Hierarchy
from .known_sums import corrected
from .link_sums import received_by_leaves, received_over_clusters, sent_by_leaves
from .links import Links
from .node_samples import node_samples
from .parallel import for_chunks
from .sampling import cosine_hemisphere, stratified_square, to_world
from .transport import pull
from .tree_top import TreeTop
from .visibility import RayCaster

RAYS = 32
"""Hemisphere rays of a leaf; in a closed scene they all agree, and there is no noise at all."""

LAMP_RAYS = 512
"""Rays of a leaf that shines, where some of the others escape: most power starts there."""

ROUNDS = 8
"""How often both balances are struck in turn at most, …"""

ENOUGH = 2e-3
"""… until no face receives more or less by this part."""

AMONG_THEMSELVES = 0.65
"""Closed faces are balanced that get more than this part of their light from closed ones."""

SURE = 0.01
"""Faces that receive less than this over links to clusters, which miss more than rays, know which of their
visibilities to blame for what they lack."""

CHUNK = 1 << 13
"""Leaves measured at once: their rays take about 30 MB a thread."""

LIMIT = 2.0
"""Largest factor: a leaf with hardly any links is not blown up."""

LIMIT_RECEIVED = 1.5
"""Largest factor on what a face receives, and the inverse of the least: more is no error of a curve, and
must not be hidden."""


@dataclass(frozen=True)
class Balance:
    """What light is exchanged with.

    Attributes
    ----------
    links : Links
        To elements, their visibilities corrected (see `known_sums`).
    sent, received : (e, 2) float64
        What leaves' radiosity and their gathered light are scaled with, over their own links and
        over those they share with their ancestors and clusters; 1 where nothing is known.
    """

    links: Links
    sent: Array
    received: Array


class Conservation:
    """Remembers what share of each leaf's light arrives, leaf by leaf as they appear."""

    def __init__(self, caster: RayCaster, min_area: float, seed: int, threads: int = 0) -> None:
        self._caster, self._min_area, self._seed, self._threads = caster, min_area, seed, threads
        self._arriving = np.zeros(0)

    def balance(
        self,
        hierarchy: Hierarchy,
        top: TreeTop,
        links: Links,
        cluster_links: ClusterLinks,
        rough: bool = False,
    ) -> Balance:
        """Return what to exchange light with, in place of what was measured.

        Parameters
        ----------
        rough : bool
            While links are still refined: visibilities stay as they are, and one round has to do.
        """
        self._measure(hierarchy)
        closed = self.closed(hierarchy)
        scale, received = np.ones((2, hierarchy.n_elements, 2))
        sure = closed & (received_over_clusters(hierarchy, top, cluster_links, scale) < SURE)
        if sure.any() and not rough:
            rows = sum(received_by_leaves(hierarchy, top, links, cluster_links, scale))
            columns = sum(sent_by_leaves(hierarchy, top, links, cluster_links))
            sums = pull(hierarchy, np.stack([rows, columns], axis=1))[: len(hierarchy.faces)]
            links = corrected(hierarchy, links, sure, sums[:, 0], sums[:, 1])
        leaves = hierarchy.leaves
        if closed.any() and not closed.all():
            # What closed faces get from others, whose own sums nobody knows, is not theirs to correct.
            among = np.where(closed[hierarchy.face], 1.0, 0.0)[:, None] * scale
            get = sum(received_by_leaves(hierarchy, top, links, cluster_links, scale))
            get_from_closed = sum(received_by_leaves(hierarchy, top, links, cluster_links, among))
            gets = pull(hierarchy, np.stack([get, get_from_closed], axis=1))[: len(closed)]
            closed &= gets[:, 1] > AMONG_THEMSELVES * gets[:, 0]
        leaves = leaves[closed[hierarchy.face[leaves]]]
        whole, split = leaves[leaves < len(closed)], leaves[leaves >= len(closed)]
        rounds = 1 if rough else ROUNDS
        for number in range(rounds if len(leaves) else 0):
            own, shared = received_by_leaves(hierarchy, top, links, cluster_links, scale)
            if number > 0:
                sums = pull(hierarchy, received * np.stack([own, shared], axis=1)).sum(axis=1)
                if np.abs(sums[: len(closed)][closed] - 1.0).max() < ENOUGH:
                    break
            received[whole] = _over_all(own[whole] + shared[whole])[:, None]
            received[split] = _over_shared(np.ones(len(split)), own[split], shared[split])
            scale = self.factors(hierarchy, top, links, cluster_links, received)
        if not len(leaves):
            scale = self.factors(hierarchy, top, links, cluster_links)
        return Balance(links, scale, received)

    def closed(self, hierarchy: Hierarchy) -> Array:
        """Return (f,) whether no ray of a face left the scene; after `factors`."""
        face = hierarchy.face[hierarchy.leaves]
        arrived = self._arriving[hierarchy.leaves] == 1.0
        return np.asarray(np.bincount(face, ~arrived, len(hierarchy.faces)) == 0)

    def factors(
        self,
        hierarchy: Hierarchy,
        top: TreeTop,
        links: Links,
        cluster_links: ClusterLinks,
        received: Array | None = None,
    ) -> Array:
        """Return (e, 2): what to scale leaves' radiosity with, over own links and over shared ones.

        Parameters
        ----------
        received : (e, 2) float64 or None
            What the leaves' gathered light is scaled with, as from `balance`.
        """
        self._measure(hierarchy)
        leaves = hierarchy.leaves
        own, shared = sent_by_leaves(hierarchy, top, links, cluster_links, received)
        result = np.ones((hierarchy.n_elements, 2))
        result[leaves] = _over_shared(self._arriving[leaves], own[leaves], shared[leaves])
        return result

    def _measure(self, hierarchy: Hierarchy) -> None:
        """Trace the rays of leaves that are new."""
        known = len(self._arriving)
        self._arriving = np.concatenate([self._arriving, np.full(hierarchy.n_elements - known, np.nan)])
        leaves = hierarchy.leaves
        new = leaves[np.isnan(self._arriving[leaves])]
        faces = new[new < len(hierarchy.faces)]
        if len(faces):
            # Neighbours that together are no larger than an element may be share their rays.
            large = np.flatnonzero(hierarchy.clusters.area > self._min_area)
            top = TreeTop(hierarchy, large)
            share = self._share(hierarchy, top.tips)
            self._arriving[faces] = share[top.tip[faces] - top.n_inner]
        below = new[len(faces) :]
        self._arriving[below] = self._share(hierarchy, hierarchy.n_clusters + below)
        doubtful = (self._arriving[new] > 0.0) & (self._arriving[new] < 1.0)
        doubtful &= hierarchy.emission[new].any(axis=1) & (hierarchy.area[new] >= self._min_area)
        lamps = new[doubtful]
        self._arriving[lamps] = self._share(hierarchy, hierarchy.n_clusters + lamps, LAMP_RAYS)

    def _share(self, hierarchy: Hierarchy, nodes: Array, rays: int = RAYS) -> Array:
        """Return (n,) the share of the light of nodes that arrives anywhere."""
        share = np.empty(len(nodes))
        # What ends on the black back of a one-sided triangle arrives nowhere either.
        faces = hierarchy.faces
        has_black_backs = 2 * int(faces.front.sum()) > len(faces)

        def measure(rows: slice) -> None:
            chosen = nodes[rows]
            quarter = np.broadcast_to(np.arange(rays) % 4, (len(chosen), rays))
            points, normals = node_samples(hierarchy, chosen, quarter, chosen, self._seed + 41)
            unit = stratified_square(chosen, rays, self._seed + 42)
            normals = normals.reshape(-1, 3)
            directions = to_world(cosine_hemisphere(unit).reshape(-1, 1, 3), normals)[:, 0]
            start = points.reshape(-1, 3) + self._caster.surface_offset * normals
            if has_black_backs:
                hits = self._caster.first_hits(start, directions)
                face = faces.of_triangle[(~hits.front).astype(np.int8), hits.triangle]
                lost = (hits.triangle < 0) | (face < 0)
            else:
                lost = self._caster.passing(start, directions, np.full(len(start), np.inf))
            share[rows] = 1.0 - lost.reshape(-1, rays).mean(axis=1)

        for_chunks(measure, len(nodes), CHUNK * RAYS // rays, self._threads)
        return share


def _over_all(sums: Array) -> Array:
    """Return (n,) what (n,) sums are scaled with to make 1, within `LIMIT_RECEIVED`."""
    wanted = np.clip(1.0 / np.maximum(sums, 1e-300), 1.0 / LIMIT_RECEIVED, LIMIT_RECEIVED)
    return np.where(sums > 0, wanted, 1.0)


def _over_shared(wanted: Array, own: Array, shared: Array) -> Array:
    """Return (n, 2) what own and shared are scaled with to make `wanted`: own, if it can be, with 1."""
    left = np.maximum(wanted - own, 0.0)
    return np.stack(
        [
            np.minimum(1.0, wanted / np.maximum(own, 1e-300)),
            np.where(shared > 0, np.minimum(left / np.maximum(shared, 1e-300), LIMIT), 1.0),
        ],
        axis=1,
    )


def received_by_faces(
    hierarchy: Hierarchy, top: TreeTop, balance: Balance, cluster_links: ClusterLinks
) -> Array:
    """Return (f,) ΣFV over each face's, its elements' and its clusters' links, as balanced."""
    own, shared = received_by_leaves(hierarchy, top, balance.links, cluster_links, balance.sent)
    balanced = balance.received * np.stack([own, shared], axis=1)
    return np.asarray(pull(hierarchy, balanced)[: len(hierarchy.faces)].sum(axis=1))
