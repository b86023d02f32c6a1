"""Whether a hierarchy and its links that were read from a file can be solved, see `sidecar_checks.py`."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from ...numerics import Array
from ...scene import Faces
from ...solver.balance import Balance
from ...solver.element_transport import ElementTransport
from ...solver.emitters import LightSources
from ...solver.hierarchy import LEAF, Clusters, Hierarchy, TreeTop
from ...solver.links import ClusterLinks, LightLinks, Links
from ...solver.methods import HierarchicalState
from ...solver.settings import SolverSettings
from .value_checks import LARGE, SLACK, instance, integers, number, numbers, require, whole

MOST_THREADS, MOST_LEVELS = 4096, 64

MOST_FACTOR = 1e3
"""Means of samples may exceed what the exact form factor cannot."""


def check_elements(transport: ElementTransport, sources: LightSources, triangles: int) -> int:
    """Check the hierarchy with its links; return the number of elements."""
    state = instance(transport._state, HierarchicalState)
    if transport._sources is not sources:
        raise ValueError("sources of something else")
    settings = instance(state.settings, SolverSettings)
    for name, value in asdict(settings).items():
        if type(value) is not type(getattr(SolverSettings(), name)):
            number(value, 0.0)
    whole(settings.threads, 0, MOST_THREADS)
    number(settings.tolerance, 0.0)
    hierarchy = instance(state.hierarchy, Hierarchy)
    _check_hierarchy(hierarchy, triangles)
    clusters, count = len(hierarchy.clusters), hierarchy.n_elements
    top = state.top
    if top is not None:
        _check_top(instance(top, TreeTop), hierarchy)
    if state.balance is not None:
        balance = instance(state.balance, Balance)
        numbers(balance.sent, (count, 2), 0.0)
        numbers(balance.received, (count, 2), 0.0)
        _check_links(instance(balance.links, Links), clusters, count, top)
    else:
        _check_links(instance(state.links, Links), clusters, count, top)
    _check_cluster_links(instance(state.cluster_links, ClusterLinks), clusters, count, top)
    links = instance(transport._light_links, LightLinks)
    integers(links.receiver, (len(links.receiver),), 0, count - 1)
    integers(links.light, links.receiver.shape, 0, len(sources.lights) - 1)
    numbers(links.gain, (len(links.receiver), 4), 0.0)
    for name in ("power", "residual", "over_budget", "faint"):
        number(getattr(state, name), 0.0)
    number(state.started, -LARGE)
    whole(state.iterations, 0, 1 << 62)
    return count


def _check_hierarchy(hierarchy: Hierarchy, triangles: int) -> None:
    faces, clusters = instance(hierarchy.faces, Faces), instance(hierarchy.clusters, Clusters)
    f, c, e = len(faces.triangle), len(clusters.start), len(hierarchy.face)
    integers(faces.triangle, (f,), 0, triangles - 1)
    numbers(faces.normal, (f, 3), -1.0 - SLACK, 1.0 + SLACK)
    numbers(faces.centre, (f, 3), -LARGE)
    numbers(faces.area, (f,), 0.0)
    integers(clusters.order, (f,), 0, f - 1)
    integers(clusters.start, (c,), 0, f - 1)
    integers(clusters.children, (c, 2), 0, c + f - 1)
    numbers(clusters.area, (c,), 0.0)
    numbers(clusters.centre, (c, 3), -LARGE)
    require((clusters.area > 0.0).all(), "a cluster without area")
    require((np.bincount(clusters.order, minlength=f) == 1).all(), "faces in no order")
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
    numbers(hierarchy.opacity, (e,), 0.0, 1.0 + SLACK)


def _check_levels(levels: Any, count: int) -> None:
    """Refuse levels that do not divide `count` rows among them, in order."""
    at = 0
    for level in instance(levels, list):
        whole = isinstance(level, slice) and level.step is None and level.start == at
        if not whole or type(level.stop) is not int or not at < level.stop <= count:
            raise ValueError("levels")
        at = level.stop
    require(at == count, "levels")


def _check_top(top: TreeTop, hierarchy: Hierarchy) -> None:
    clusters, faces = hierarchy.clusters, hierarchy.faces
    f, c = len(faces.triangle), len(clusters.start)
    require(top._clusters is clusters, "clusters of something else")
    whole(top.n_inner, 0, c)
    tips = len(top._start)
    whole(top.n_rows, top.n_inner + tips, top.n_inner + tips)
    integers(top.row, (c,), -1, top.n_rows - 1)
    integers(top.tip, (f,), top.n_inner, top.n_rows - 1)
    integers(top._start, (tips,), 0, f - 1)
    require(bool((np.diff(top._start) > 0).all()) and (top._start[:1] == 0).all(), "tips in no order")
    require(tips > 0 or f == 0, "no tips")
    integers(top._children, (top.n_inner, 2), 0, top.n_rows - 1)
    numbers(top._area, (f,), 0.0)
    _check_levels(top._levels, top.n_inner)
    for level in top._levels:
        require((top._children[level] >= level.stop).all(), "a cluster in itself")


def _check_links(links: Links, clusters: int, elements: int, top: TreeTop | None) -> None:
    count = len(links.receiver)
    integers(links.receiver, (count,), 0, elements - 1)
    require((np.diff(links.receiver) >= 0).all(), "links in no order")
    integers(links.source, (count,), 0, clusters + elements - 1)
    _in_top(links.source, clusters, top)
    numbers(links.factor, (count,), 0.0, MOST_FACTOR)
    numbers(links.visibility, (count,), 0.0, 1.0 + SLACK)
    numbers(links.to_quarter, (count, 4), 0.0, 4.0 + SLACK)
    numbers(links.of_quarter, (count, 4), 0.0, 4.0 + SLACK)


def _check_cluster_links(links: ClusterLinks, clusters: int, elements: int, top: TreeTop | None) -> None:
    count = len(links.receiver)
    integers(links.receiver, (count,), 0, clusters - 1)
    integers(links.source, (count,), 0, clusters + elements - 1)
    require(count == 0 or top is not None, "links to clusters that are not there")
    _in_top(links.receiver, clusters, top)
    _in_top(links.source, clusters, top)
    numbers(links.vector, (count, 3), -LARGE)
    numbers(links.gradient, (count, 3), -LARGE)
    numbers(links.even, (count,), -LARGE)


def _in_top(nodes: Array, clusters: int, top: TreeTop | None) -> None:
    """Refuse clusters that the top of the tree has no row for."""
    if top is not None:
        require((top.row[nodes[nodes < clusters]] >= 0).all(), "a cluster below the top")
