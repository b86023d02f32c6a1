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

What a leaf receives is not scaled: the sweeps over texels gather with rays, whose shares add up to 1.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array
from ...rays import RayCaster
from ..hierarchy import ClusterCut, Hierarchy
from ..links import ClusterLinks, Links
from .enclosure import Arrivals
from .link_sums import sent_by_leaves

STANDARD_ERRORS = 3.0
"""Standard errors by which a leaf's own links may exceed its rays' estimate."""

MAX_FACTOR = 2.0
"""Largest factor, which limits leaves with hardly any links, …"""

LIMIT_CLOSED = 32.0
"""… and the limit where all light arrives: there is no noise, and light that is not sent would be lost."""


class Conservation:
    """Makes links exchange the share of each leaf's light that arrives."""

    def __init__(self, caster: RayCaster, min_area: float, seed: int, threads: int = 0) -> None:
        self.arrivals = Arrivals(caster, min_area, seed, threads)

    def closed(self, hierarchy: Hierarchy) -> Array:
        """Return (f,) whether all rays of a face arrived; after `factors`."""
        face = hierarchy.face[hierarchy.leaves]
        arrived = self.arrivals.share[hierarchy.leaves] == 1.0
        return np.asarray(np.bincount(face, ~arrived, len(hierarchy.faces)) == 0)

    def factors(
        self, hierarchy: Hierarchy, cut: ClusterCut, links: Links, cluster_links: ClusterLinks
    ) -> Array:
        """Return (e, 2): factors on leaves' radiosity, over own links and over shared ones.

        1 for elements that are no leaves.
        """
        self.arrivals.measure(hierarchy)
        leaves = hierarchy.leaves
        own, shared = (sums[leaves] for sums in sent_by_leaves(hierarchy, cut, links, cluster_links))
        result = np.ones((hierarchy.n_elements, 2))
        arriving = self.arrivals.share[leaves]
        limit = np.where(arriving == 1.0, LIMIT_CLOSED, MAX_FACTOR)
        # Own links are better than few rays: scaled down for rays' noise, and not up, they would lose power.
        most = np.minimum(arriving + STANDARD_ERRORS * self.arrivals.error(leaves), 1.0)
        result[leaves, 0] = np.minimum(1.0, most / np.maximum(own, 1e-300))
        left = np.maximum(arriving - own, 0.0)
        scale = np.minimum(left / np.maximum(shared, 1e-300), limit)
        result[leaves, 1] = np.where(shared > 0, scale, 1.0)
        return result
