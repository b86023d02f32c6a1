"""The first links: from every face to what it sees, coarsely, without pairing all with all."""

from __future__ import annotations

import numpy as np

from .hierarchy import Hierarchy
from .links import Links, join, measure_links
from .settings import SolverSettings
from .visibility import RayCaster

FIRST_SIZE = 0.4
"""First links go to clusters whose radius, with the face's own, is at most this part of their distance, …"""

MIXED_SIZE = 0.3
"""… or this part where their faces look different ways: some may be bright and turned away."""

COHERENT = 0.9
"""From this length of the mean normal on, a cluster's faces look the same way."""

FIRST_FACES = 21_000
"""Beyond so many faces each can afford fewer links: the two sizes grow with the square of their
number, which keeps first links at a few millions, …"""

LARGEST_SIZE = 2.0
"""… up to this."""


def first_links(hierarchy: Hierarchy, caster: RayCaster, settings: SolverSettings) -> Links:
    """Link every face to clusters that look small from it, and to single faces nearby.

    Starts from one pair per face and root; a cluster that looks too large is opened.
    """
    clusters, faces = hierarchy.clusters, hierarchy.faces
    radius = 0.5 * np.linalg.norm(clusters.upper - clusters.lower, axis=1)
    middle = 0.5 * (clusters.upper + clusters.lower)
    half = 0.5 * (clusters.upper - clusters.lower)
    centre = faces.corners.mean(axis=1)
    crowd = max(len(faces) / FIRST_FACES, 1.0) ** 2
    own_radius = np.linalg.norm(faces.corners - centre[:, None], axis=2).max(axis=1)
    size = np.where(clusters.coherence >= COHERENT, FIRST_SIZE, MIXED_SIZE)
    size = np.minimum(size * crowd, LARGEST_SIZE)

    receiver = np.repeat(np.arange(len(faces)), len(hierarchy.roots))
    source = np.tile(hierarchy.roots, len(faces))
    parts: list[Links] = []
    while len(receiver):
        is_cluster = source < len(clusters)
        ready_receiver, ready_source = [receiver[~is_cluster]], [source[~is_cluster]]
        receiver, source = receiver[is_cluster], source[is_cluster]
        # A cluster wholly behind the receiver's plane sends it nothing: exactly so.
        along = middle[source] - centre[receiver]
        normal = faces.normal[receiver]
        rise = np.einsum("nk,nk->n", along, normal) + np.einsum("nk,nk->n", half[source], np.abs(normal))
        above = rise > 0
        receiver, source, along = receiver[above], source[above], along[above]
        distance = np.linalg.norm(along, axis=1)
        small = radius[source] + own_radius[receiver] <= size[source] * distance
        ready_receiver.append(receiver[small])
        ready_source.append(source[small])
        pairs = np.concatenate(ready_receiver), np.concatenate(ready_source)
        parts.append(measure_links(hierarchy, caster, *pairs, settings.seed, settings.threads))
        receiver = np.repeat(receiver[~small], 2)
        source = clusters.children[source[~small]].ravel()
    return join(parts).sorted_by_receiver()
