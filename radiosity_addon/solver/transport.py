"""Moving light over the links: gather, push-pull and the residual (handout §4.2)."""

from __future__ import annotations

import numpy as np

from .hierarchy import LEAF, Hierarchy
from .links import Links


def gather(links: Links, node_radiosity: np.ndarray, n_elements: int) -> np.ndarray:
    """Collect the irradiance that arrives over each element's own links.

    H_r = Σ_s F_rs V_rs B_s over the links of receiver r (handout §4.2, Gather).

    Parameters
    ----------
    links : Links
        Sorted by receiver.
    node_radiosity : (n_nodes, 3) float64
        Radiosity of clusters, then elements [W/m²].
    n_elements : int

    Returns
    -------
    irradiance : (n_elements, 3) float64
        Each element's own share [W/m²]; `push` adds its ancestors'.
    """
    irradiance = np.zeros((n_elements, 3))
    if len(links) == 0:
        return irradiance
    weight = links.factor * links.visibility
    first = np.flatnonzero(np.diff(links.receiver, prepend=-1))
    for channel in range(3):
        arriving = weight * node_radiosity[links.source, channel]
        irradiance[links.receiver[first], channel] = np.add.reduceat(arriving, first)
    return irradiance


def push(hierarchy: Hierarchy, own: np.ndarray) -> np.ndarray:
    """Add to every element what its ancestors receive; radiosity is per area, so no factors.

    Parameters
    ----------
    own : (e, k) float64

    Returns
    -------
    total : (e, k) float64
        Meaningful at the leaves.
    """
    total = own.copy()
    for parents in inner_by_level(hierarchy):
        children = hierarchy.first_child[parents][:, None] + np.arange(4)
        total[children] += total[parents][:, None]
    return total


def pull(hierarchy: Hierarchy, at_leaves: np.ndarray) -> np.ndarray:
    """Average the leaves' values upwards; the four children of an element have equal areas.

    Parameters
    ----------
    at_leaves : (e, k) float64
        Only the leaves' rows count.

    Returns
    -------
    everywhere : (e, k) float64
    """
    values = at_leaves.copy()
    for parents in reversed(inner_by_level(hierarchy)):
        children = hierarchy.first_child[parents][:, None] + np.arange(4)
        values[parents] = values[children].mean(axis=1)
    return values


def push_pull(
    hierarchy: Hierarchy, own_irradiance: np.ndarray, emission: np.ndarray, reflectance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Push irradiance to the leaves, reflect it there, and pull radiosity up (handout §4.2).

    Parameters
    ----------
    own_irradiance : (e, 3) float64
        What each element gathered itself [W/m²].
    emission, reflectance : (e, 3) float64

    Returns
    -------
    irradiance : (e, 3) float64
        Area means over the leaves below every element.
    radiosity : (e, 3) float64
    """
    irradiance = push(hierarchy, own_irradiance)
    radiosity = pull(hierarchy, emission + reflectance * irradiance)
    return pull(hierarchy, irradiance), radiosity


def inner_by_level(hierarchy: Hierarchy) -> list[np.ndarray]:
    """Return the elements with children, the coarsest level first."""
    inner = np.flatnonzero(hierarchy.first_child != LEAF)
    level = hierarchy.level[inner]
    return [inner[level == depth] for depth in range(int(level.max(initial=-1)) + 1)]


def node_radiosity(hierarchy: Hierarchy, radiosity: np.ndarray) -> np.ndarray:
    """Put the clusters' area means above the elements' radiosity: (n_nodes, 3)."""
    faces = len(hierarchy.faces)
    clusters = hierarchy.clusters.average(radiosity[:faces], hierarchy.faces.area)
    return np.concatenate([clusters, radiosity])
