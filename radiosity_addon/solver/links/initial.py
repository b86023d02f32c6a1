"""Initial linking: from one pair of roots down to pairs that look small from each other.

Nowhere are all faces paired with all: a pair of nodes is dropped once one lies behind the
other, linked once both look small, and opened on its larger side otherwise. Faces far
smaller than the smallest requested element are never separated: clusters below A_ε are linked
however near they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...numerics import Array
from ...rays import RayCaster
from ..hierarchy import Hierarchy, NodeShapes
from ..settings import SolverSettings
from .cluster_links import ClusterLinks
from .cluster_pairs import measure_cluster_links
from .element_links import Links, measure_links

MAX_RADII = 0.5
"""Nodes are linked where their radii together are at most this part of their distance, …"""

MIXED_SIZE = 0.4
"""… or this part where the source's faces look different ways: some may be bright and turned away, …"""

FACE_SIZE = 0.4
"""… or this part where a single face receives: its links have no gradient."""

CONE = 0.35
"""Faces receive together if none deviates more than this from their mean [rad], or if light is faint."""

BUDGET = 0.4
"""Initial links may take this part of `SolverSettings.max_links`; refinement needs the rest …"""

MIN_LINKS = 200_000
"""… but at least this many: with fewer, the solution would be meaningless."""

WANTED = 6000.0
"""Divided by the square root of BF_ε: the target number of initial links, as refinement adds those that
carry light, …"""

COARSEST_FAINT = 8.0
"""… unless pairs that exchange more than this times BF_ε, as a share of all area, were merged into one
link: then only the budget limits them. A link's error estimate is about an eighth of its factor, more where
    it is
refined."""

FAINT = 1e-7
"""Where there are more, pairs that exchange less than this share of all area are linked regardless of size
and orientation; where that is not enough, …"""

FAINTER = 2.0
"""… the share is multiplied by this, repeatedly."""

THINNED = 1 << 14
"""Pairs followed at a time to estimate the number of initial links."""

LINK_SLACK = 1.25
"""Initial links may exceed the estimate by this factor."""

BLOCK_PAIRS = 1 << 16
"""Pairs processed together: their temporaries, some 20 MB, stay near the processor."""


def first_links(
    hierarchy: Hierarchy, shapes: NodeShapes, caster: RayCaster, settings: SolverSettings, max_links: int
) -> tuple[Links, ClusterLinks, float]:
    """Link all nodes that may see each other, coarsely.

    max_links: The whole budget of links, of which these take `BUDGET`.
    Returns links: To faces, sorted by receiver.
    Returns cluster_links: To clusters.
    Returns faint: Pairs that exchange less than this share of all area had to be linked however large they
        look, to keep within the budget; 0 if none.
    """
    most = max(int(BUDGET * max_links), MIN_LINKS)
    wanted = WANTED / max(settings.error, 1e-9) ** 0.5
    limits = PairLimits(float(hierarchy.faces.area.sum()), settings.min_area)
    limits, pairs = _fitting(hierarchy, shapes, limits, settings.error, wanted, most), None
    while pairs is None:
        pairs = first_pairs(hierarchy, shapes, limits, int(LINK_SLACK * most))
        if pairs is None:
            limits = limits.looser()
    count, (receiver, source) = hierarchy.n_clusters, pairs
    single = receiver >= count
    seed, threads = settings.seed, settings.threads
    to_faces = measure_links(hierarchy, caster, receiver[single] - count, source[single], seed, threads)
    to_clusters = measure_cluster_links(
        hierarchy, shapes, caster, receiver[~single], source[~single], seed, threads
    )
    return to_faces.sorted_by_receiver(), to_clusters, limits.faint


@dataclass(frozen=True)
class PairLimits:
    """Limits of size, distance and curvature for nodes to be linked without opening them.

    `area` is all faces' [m²]; `tiny`, of nodes, and `faint`, of what a pair exchanges, are shares of it.
    """

    area: float
    tiny: float
    faint: float = 0.0

    def looser(self) -> PairLimits:
        """Return limits of fewer pairs: `faint` grows."""
        return replace(self, faint=FAINTER * self.faint if self.faint > 0.0 else FAINT)


def _fitting(
    hierarchy: Hierarchy, shapes: NodeShapes, limits: PairLimits, error: float, wanted: float, most: int
) -> PairLimits:
    """Return the strictest limits that keep the estimated links within what is wanted.

    Where not even `COARSEST_FAINT` does, those from there on that keep them within `most`.
    """
    steps = [limits]
    while FAINTER * steps[-1].faint <= COARSEST_FAINT * error:
        steps.append(steps[-1].looser())
    few, last = min(wanted, most), len(steps) - 1
    if estimated_links(hierarchy, shapes, limits) <= few:
        return limits
    # Links only get fewer from step to step.
    low, high = 0, last
    while high - low > 1:
        middle = (low + high) // 2
        enough = estimated_links(hierarchy, shapes, steps[middle]) <= few
        low, high = (low, middle) if enough else (middle, high)
    found = steps[high]
    while high == last and estimated_links(hierarchy, shapes, found) > most:
        found = found.looser()
    return found


def first_pairs(
    hierarchy: Hierarchy, shapes: NodeShapes, limits: PairLimits, most: int
) -> tuple[Array, Array] | None:
    """Return the (n,) receivers and sources of the initial links; None if there are more than `most`."""
    waiting = [_root_pairs(hierarchy)]
    receivers, sources, found = [], [], 0
    while waiting:
        # The latest first, block by block: what waits never grows to a whole generation.
        receiver, source = waiting.pop()
        if len(receiver) > BLOCK_PAIRS:
            waiting.append((receiver[BLOCK_PAIRS:], source[BLOCK_PAIRS:]))
            receiver, source = receiver[:BLOCK_PAIRS], source[:BLOCK_PAIRS]
        ready, opened = _judge(hierarchy, shapes, receiver, source, limits)
        receivers.append(ready[0].astype(np.int32))
        sources.append(ready[1].astype(np.int32))
        found += len(ready[0])
        if found > most:
            return None
        if len(opened[0]):
            waiting.append(opened)
    return np.concatenate(receivers), np.concatenate(sources)


def estimated_links(hierarchy: Hierarchy, shapes: NodeShapes, limits: PairLimits) -> float:
    """Estimate the number of initial links from a sample of pairs.

    Whenever more than `THINNED` pairs are to be opened, that many are drawn, and stand for all.
    """
    chance = np.random.default_rng(0)
    receiver, source = _root_pairs(hierarchy)
    total, weight = 0.0, 1.0
    while len(receiver):
        ready, (receiver, source) = _judge(hierarchy, shapes, receiver, source, limits)
        total += weight * len(ready[0])
        if len(receiver) > THINNED:
            drawn = chance.choice(len(receiver), THINNED, replace=False)
            weight *= len(receiver) / THINNED
            receiver, source = receiver[drawn], source[drawn]
    return total


def _root_pairs(hierarchy: Hierarchy) -> tuple[Array, Array]:
    """Return the (n,) receivers and sources of the start: every root with every root."""
    count = len(hierarchy.roots)
    return np.repeat(hierarchy.roots, count), np.tile(hierarchy.roots, count)


def _judge(
    hierarchy: Hierarchy, shapes: NodeShapes, receiver: Array, source: Array, limits: PairLimits
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return the pairs to link, and those that result from opening the others."""
    may = shapes.may_see(receiver, source)
    receiver, source = receiver[may], source[may]
    coarse = _looks_small(shapes, receiver, source, limits)
    wide = shapes.cone(receiver) > CONE
    ready = coarse & ~wide
    if limits.faint > 0.0:
        ready |= shapes.exchange_bound(receiver, source) <= limits.faint * limits.area
    # Where only its many directions keep the receiver from being linked, opening the source is no use.
    opened = _open_larger(hierarchy, shapes, receiver[~ready], source[~ready], (coarse & wide)[~ready])
    return (receiver[ready], source[ready]), opened


def _looks_small(shapes: NodeShapes, receiver: Array, source: Array, limits: PairLimits) -> Array:
    """Return (n,) which pairs are linked as they are, if the receiver's faces look much the same way."""
    to_face, of_face = receiver >= shapes.count, source >= shapes.count
    of_mixed = shapes.cone(source) > CONE
    size = np.where(of_mixed, MIXED_SIZE, MAX_RADII)
    size = np.where(to_face, np.minimum(size, FACE_SIZE), size)
    far = ~shapes.looks_large(receiver, source, size)
    # A face next to a cluster is linked separately: samples would scatter there.
    tiny = limits.tiny * limits.area
    small = (shapes.area(receiver) <= tiny) & (shapes.area(source) <= tiny) & ~to_face & ~of_mixed
    return np.asarray(far | small | (to_face & of_face))


def _open_larger(
    hierarchy: Hierarchy,
    shapes: NodeShapes,
    receiver: Array,
    source: Array,
    only_receiver: Array,
) -> tuple[Array, Array]:
    """Replace pairs by pairs with the two children of their larger cluster."""
    count, children = hierarchy.n_clusters, hierarchy.clusters.children
    # Clusters with many directions are opened instead: they may not receive.
    weight = np.where(shapes.cone(receiver) > CONE, 2.0, 1.0)
    larger = weight * shapes.radius(receiver) >= shapes.radius(source)
    opened = (receiver < count) & ((source >= count) | larger | only_receiver)
    return (
        np.concatenate([children[receiver[opened]].ravel(), np.repeat(receiver[~opened], 2)]),
        np.concatenate([np.repeat(source[opened], 2), children[source[~opened]].ravel()]),
    )
