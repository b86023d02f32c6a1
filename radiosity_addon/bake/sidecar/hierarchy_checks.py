"""Whether a hierarchy and its links that were read from a file can be solved, see `sidecar_checks.py`."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from ...scene import Faces
from ...solver.element_transport import ElementTransport
from ...solver.gather import MOST_TINT
from ...solver.hierarchy import LEAF, Clusters, Hierarchy
from ...solver.links import ClusterLinks, LightLinks, Links
from ...solver.methods import HierarchicalState
from ...solver.settings import SolverSettings
from .value_checks import LARGE, SHARE_TOLERANCE, instance, integers, number, numbers, require, whole

MOST_THREADS, MOST_LEVELS = 4096, 64

MOST_FACTOR = 1e3
"""Means of samples may exceed what the exact form factor cannot."""


def check_elements(transport: ElementTransport, lights: int, triangles: int) -> int:
    """Check the hierarchy with its links; return the number of elements."""
    state = instance(transport.state, HierarchicalState)
    settings = instance(state.settings, SolverSettings)
    for name, value in asdict(settings).items():
        if type(value) is not type(getattr(SolverSettings(), name)):
            number(value, 0.0)
    whole(settings.threads, 0, MOST_THREADS)
    whole(settings.seed, 0, 1 << 64)
    number(settings.tolerance, 0.0)
    hierarchy = instance(state.hierarchy, Hierarchy)
    _check_hierarchy(hierarchy, triangles)
    clusters, count = len(hierarchy.clusters), hierarchy.n_elements
    if state.sent is not None:
        numbers(state.sent, (count, 2), 0.0)
    _check_links(instance(state.links, Links), clusters, count)
    links = instance(state.cluster_links, ClusterLinks)
    require(len(links) == 0 or state.sent is not None, "links to clusters without factors")
    _check_cluster_links(links, clusters, count)
    of_lights = instance(transport.light_links, LightLinks)
    integers(of_lights.receiver, (len(of_lights.receiver),), 0, count - 1)
    integers(of_lights.light, of_lights.receiver.shape, 0, lights - 1)
    channels = np.shape(of_lights.gain)[2:]
    require(channels in ((), (3,)), "gains of no channels")
    numbers(of_lights.gain, (len(of_lights.receiver), 4, *channels), 0.0)
    return count


def _check_hierarchy(hierarchy: Hierarchy, triangles: int) -> None:
    faces, clusters = instance(hierarchy.faces, Faces), instance(hierarchy.clusters, Clusters)
    f, c, e = len(faces.triangle), len(clusters.start), len(hierarchy.face)
    integers(faces.triangle, (f,), 0, triangles - 1)
    numbers(faces.normal, (f, 3), -1.0 - SHARE_TOLERANCE, 1.0 + SHARE_TOLERANCE)
    numbers(faces.center, (f, 3), -LARGE)
    numbers(faces.area, (f,), 0.0)
    integers(clusters.order, (f,), 0, f - 1)
    integers(clusters.start, (c,), 0, f - 1)
    integers(clusters.children, (c, 2), 0, c + f - 1)
    numbers(clusters.area, (c,), 0.0)
    numbers(clusters.center, (c, 3), -LARGE)
    require((clusters.area > 0.0).all(), "a cluster without area")
    require((np.bincount(clusters.order, minlength=f) == 1).all(), "faces in no order")
    nodes = np.concatenate([hierarchy.roots, clusters.children.ravel()])
    integers(nodes, nodes.shape, 0, c + f - 1)
    require((np.bincount(nodes, minlength=c + f) == 1).all(), "a cluster of nobody, or of several")
    _check_levels(clusters.levels, c)
    for level in clusters.levels:
        below = clusters.children[level]
        require(((below >= level.stop) | (below >= c)).all(), "a cluster in itself")
    integers(hierarchy.face, (e,), 0, f - 1)
    require(e >= f and bool((hierarchy.face[:f] == np.arange(f)).all()), "faces without elements")
    child, depth = hierarchy.first_child, hierarchy.level
    integers(child, (e,), LEAF, e - 4)
    integers(depth, (e,), 0, MOST_LEVELS)
    parents = np.flatnonzero(child != LEAF)
    children = child[parents][:, None] + np.arange(4)
    require((children >= f).all(), "an element that is its own")
    require((depth[children] == depth[parents][:, None] + 1).all(), "elements in a circle")
    require(len(np.unique(children)) == children.size == e - f, "elements of nobody, or of several")
    numbers(hierarchy.area, (e,), 0.0)
    numbers(hierarchy.reflectance, (e, 3), 0.0, 1.0)
    numbers(hierarchy.emission, (e, 3), 0.0)
    numbers(hierarchy.opacity, (e,), 0.0, 1.0 + SHARE_TOLERANCE)


def check_tints(tints: Any, shape: tuple[int, ...]) -> None:
    """Refuse tints that are there and not by channel of links of a shape, or out of range."""
    if tints is not None:
        numbers(tints, (*shape, 3), 0.0, MOST_TINT)


def _check_levels(levels: Any, count: int) -> None:
    """Refuse levels that do not divide `count` rows among them, in order."""
    at = 0
    for level in instance(levels, list):
        whole = isinstance(level, slice) and level.step is None and level.start == at
        if not whole or type(level.stop) is not int or not at < level.stop <= count:
            raise ValueError("levels")
        at = level.stop
    require(at == count, "levels")


def _check_links(links: Links, clusters: int, elements: int) -> None:
    count = len(links.receiver)
    integers(links.receiver, (count,), 0, elements - 1)
    require((np.diff(links.receiver) >= 0).all(), "links in no order")
    integers(links.source, (count,), 0, clusters + elements - 1)
    numbers(links.factor, (count,), 0.0, MOST_FACTOR)
    numbers(links.visibility, (count,), 0.0, 1.0 + SHARE_TOLERANCE)
    numbers(links.to_quarter, (count, 4), 0.0, 4.0 + SHARE_TOLERANCE)
    numbers(links.of_quarter, (count, 4), 0.0, 4.0 + SHARE_TOLERANCE)
    check_tints(links.tint, (count,))


def _check_cluster_links(links: ClusterLinks, clusters: int, elements: int) -> None:
    count = len(links.receiver)
    integers(links.receiver, (count,), 0, clusters - 1)
    integers(links.source, (count,), 0, clusters + elements - 1)
    numbers(links.vector, (count, 3), -LARGE)
    numbers(links.gradient, (count, 3), -LARGE)
    numbers(links.even, (count,), -LARGE)
    check_tints(links.tint, (count,))
