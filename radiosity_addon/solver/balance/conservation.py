"""Makes every leaf send exactly the light it has.

Links of different levels do not add up at a leaf. It has fine links of its own to what is
near and shares its ancestors' coarse links to what is far; in a corner the own ones are
strong and the shared ones then too strong. The face's mean is exact, a leaf's sum may be a
quarter off, and as such leaves are also brighter or darker than the rest of their face,
power is made or lost, more with every bounce (6 % at a reflectance of 0.9).

So rays find what share of each leaf's light arrives anywhere at all, in a closed scene
simply all of it. What the leaf's own links leave of that is what it sends over shared ones:
its radiosity is scaled when they take their mean. Where its own links alone send more than
it has (faces closer together than rays can resolve are all hit), those are scaled too: so no leaf ever
sends more than it has, and the iteration converges (except what gradients of clusters make negative:
`hierarchical.STALLED`).

What a leaf receives is the same the other way round: where nothing escapes ΣFV = 1, and what its own links
leave of that is what it receives over shared ones. A face that is its own leaf has all its light scaled, as
links to clusters miss what is curved within them. Both balances are struck in turn (Sinkhorn 1964), and
before them visibilities that few rays estimate are corrected (`visibility_correction.py`). The links as
measured stay as they are: what they alone add up to is reported too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics import Array
from ...rays import RayCaster
from ..hierarchy import ClusterCut, Hierarchy
from ..links import ClusterLinks, Links, pull
from .enclosure import Arrivals
from .link_sums import received_by_leaves, received_over_clusters, sent_by_leaves
from .visibility_correction import corrected

BALANCE_ROUNDS = 8
"""Maximum number of rounds of both balances, …"""

ENOUGH = 2e-3
"""… until no face receives more or less by this part."""

AMONG_THEMSELVES = 0.65
"""Faces are balanced that get more than this part of their light from others whose sums are known."""

KNOWN = 5e-3
"""Standard error of what arrives from a face, if its sum is to count as known."""

STANDARD_ERRORS = 3.0
"""Standard errors by which a leaf's own links may exceed its rays' estimate."""

SURE = 0.01
"""In faces that receive less than this over links to clusters, which miss more than rays do, the lack can be
assigned to visibilities."""

MAX_FACTOR = 2.0
"""Largest factor, which limits leaves with hardly any links, …"""

LIMIT_CLOSED = 32.0
"""… and the limit where all light arrives: there is no noise, and light that is not sent would be lost."""

LIMIT_RECEIVED = 1.5
"""Largest factor on what a face receives, and the inverse of the smallest: a larger error is not caused by
curvature, and must not be hidden."""


@dataclass(frozen=True)
class Balance:
    """The links and factors by which light is exchanged.

    links: To elements, their visibilities corrected (see `visibility_correction.py`).
    sent, received (e, 2): What leaves' radiosity and their gathered light are scaled with, over their own
        links and over those they share with their ancestors and clusters; 1 where nothing is known.
    """

    links: Links
    sent: Array
    received: Array


class Conservation:
    """Makes links exchange the share of each leaf's light that arrives."""

    def __init__(self, caster: RayCaster, min_area: float, seed: int, threads: int = 0) -> None:
        self.arrivals = Arrivals(caster, min_area, seed, threads)

    def balance(
        self,
        hierarchy: Hierarchy,
        cut: ClusterCut,
        links: Links,
        cluster_links: ClusterLinks,
        rough: bool = False,
    ) -> Balance:
        """Return the links and factors that replace the measured ones.

        rough: While links are still refined: only what leaves send is balanced, to keep the power.
        """
        self.arrivals.measure(hierarchy)
        scale, received = np.ones((2, hierarchy.n_elements, 2))
        if rough:
            return Balance(links, self.factors(hierarchy, cut, links, cluster_links), received)
        closed = self.closed(hierarchy)
        sure = closed & (received_over_clusters(hierarchy, cut, cluster_links, scale) < SURE)
        if sure.any():
            rows = sum(received_by_leaves(hierarchy, cut, links, cluster_links, scale))
            columns = sum(sent_by_leaves(hierarchy, cut, links, cluster_links))
            sums = pull(hierarchy, np.stack([rows, columns], axis=1))[: len(closed)]
            links = corrected(hierarchy, links, sure, sums[:, 0], sums[:, 1])
        wanted, error, escapes = self.arrivals.of_faces(hierarchy)
        known = closed | (~escapes & (error < KNOWN) & (wanted > 0.0))
        if closed.any() and not known.all():
            # Light from faces whose sums are unknown cannot be corrected at the receiver.
            among = np.where(known[hierarchy.face], 1.0, 0.0)[:, None] * scale
            get = sum(received_by_leaves(hierarchy, cut, links, cluster_links, scale))
            get_from_known = sum(received_by_leaves(hierarchy, cut, links, cluster_links, among))
            gets = pull(hierarchy, np.stack([get, get_from_known], axis=1))[: len(known)]
            known &= gets[:, 1] > AMONG_THEMSELVES * gets[:, 0]
        if not (known & closed).any():
            return Balance(links, self.factors(hierarchy, cut, links, cluster_links), received)
        leaves = hierarchy.leaves[known[hierarchy.face[hierarchy.leaves]]]
        for number in range(BALANCE_ROUNDS):
            own, shared = received_by_leaves(hierarchy, cut, links, cluster_links, scale)
            if number > 0:
                sums = pull(hierarchy, received * np.stack([own, shared], axis=1)).sum(axis=1)
                if np.abs(sums[: len(known)] - wanted)[known].max() < ENOUGH:
                    break
            received[leaves] = _receive(hierarchy, leaves, own, shared, wanted, closed)
            scale = self.factors(hierarchy, cut, links, cluster_links, received)
        return Balance(links, scale, received)

    def closed(self, hierarchy: Hierarchy) -> Array:
        """Return (f,) whether all rays of a face arrived; after `factors`."""
        face = hierarchy.face[hierarchy.leaves]
        arrived = self.arrivals.share[hierarchy.leaves] == 1.0
        return np.asarray(np.bincount(face, ~arrived, len(hierarchy.faces)) == 0)

    def factors(
        self,
        hierarchy: Hierarchy,
        cut: ClusterCut,
        links: Links,
        cluster_links: ClusterLinks,
        received: Array | None = None,
    ) -> Array:
        """Return (e, 2): factors on leaves' radiosity, over own links and over shared ones.

        received (e, 2): What the leaves' gathered light is scaled with, as from `balance`.
        """
        self.arrivals.measure(hierarchy)
        leaves = hierarchy.leaves
        own, shared = sent_by_leaves(hierarchy, cut, links, cluster_links, received)
        result = np.ones((hierarchy.n_elements, 2))
        arriving = self.arrivals.share[leaves]
        limit = np.where(arriving == 1.0, LIMIT_CLOSED, MAX_FACTOR)
        result[leaves] = _over_shared(arriving, own[leaves], shared[leaves], limit)
        # Own links are better than few rays: scaled down for rays' noise, and not up, they would lose power.
        most = np.minimum(arriving + STANDARD_ERRORS * self.arrivals.error(leaves), 1.0)
        result[leaves, 0] = np.minimum(1.0, most / np.maximum(own[leaves], 1e-300))
        return result


def _receive(
    hierarchy: Hierarchy, leaves: Array, own: Array, shared: Array, wanted: Array, closed: Array
) -> Array:
    """Return (n, 2) factors on leaves' own and shared light by which faces receive the sums `wanted`.

    Leaf by leaf where all is 1. Where part ends on black backs, which few rays of a leaf estimate roughly, by
    one number a face.
    """
    face = hierarchy.face[leaves]
    of_faces = pull(hierarchy, np.stack([own, shared], axis=1))[: len(closed)]
    own = np.where(closed[face], own[leaves], of_faces[face, 0])
    shared = np.where(closed[face], shared[leaves], of_faces[face, 1])
    result = _over_shared(wanted[face], own, shared, MAX_FACTOR)
    whole = leaves < len(closed)
    result[whole] = _over_all(wanted[face], own + shared)[whole, None]
    return result


def _over_all(wanted: Array, sums: Array) -> Array:
    """Return (n,) factors from sums (n,) to `wanted`, within `LIMIT_RECEIVED`."""
    scale = np.clip(wanted / np.maximum(sums, 1e-300), 1.0 / LIMIT_RECEIVED, LIMIT_RECEIVED)
    return np.where(sums > 0, scale, 1.0)


def _over_shared(wanted: Array, own: Array, shared: Array, limit: Array | float) -> Array:
    """Return (n, 2) factors on own and shared sums to make `wanted`: 1 for own, if possible."""
    left = np.maximum(wanted - own, 0.0)
    return np.stack(
        [
            np.minimum(1.0, wanted / np.maximum(own, 1e-300)),
            np.where(shared > 0, np.minimum(left / np.maximum(shared, 1e-300), limit), 1.0),
        ],
        axis=1,
    )


def received_by_faces(
    hierarchy: Hierarchy, cut: ClusterCut, balance: Balance, cluster_links: ClusterLinks
) -> Array:
    """Return (f,) ΣFV over each face's, its elements' and its clusters' links, as balanced."""
    own, shared = received_by_leaves(hierarchy, cut, balance.links, cluster_links, balance.sent)
    balanced = balance.received * np.stack([own, shared], axis=1)
    return np.asarray(pull(hierarchy, balanced)[: len(hierarchy.faces)].sum(axis=1))
