"""One step of the hierarchical methods' iteration: Gather, then PushPull (handout §4.2)."""

from __future__ import annotations

import numpy as np

from ...numerics import Array
from ..hierarchy import ClusterCut
from ..links import (
    ClusterLinks,
    Links,
    gather,
    gather_at_clusters,
    push,
    push_pull,
    shared_means,
)
from .state import SolverState


def reflect(
    state: SolverState,
    links: Links,
    lights: Array,
    scale: Array | None = None,
    cluster_links: ClusterLinks | None = None,
    cut: ClusterCut | None = None,
) -> tuple[Array, Array]:
    """Gather over all links from the state's radiosity, then push and pull; the state stays.

    links: Sorted by receiver.
    lights (e, 3): What the leaves get straight from lamps [W/m²].
    scale (e, 2): See `transport.gather`.
    cluster_links: What the faces of clusters receive together.
    cut: With all clusters of both sets of links; needed for the second.
    Returns irradiance, radiosity (e, 3) [W/m²].
    """
    hierarchy = state.hierarchy
    means, sent = shared_means(hierarchy, state.radiosity, scale, cut)
    shared = None
    if cluster_links is not None and len(cluster_links) and cut is not None:
        threads = state.settings.threads
        # A face that looks past the horizon of what its neighbors see gets nothing, not less.
        shared = gather_at_clusters(hierarchy, cut, cluster_links, sent, threads)
        np.maximum(shared, 0.0, out=shared)
    own = gather(hierarchy, links, state.radiosity, scale, cut, (means, sent))
    # Arrays over a million elements are given up as early as possible.
    del means, sent
    gathered = push(hierarchy, own)
    if shared is not None:
        gathered += shared.take(hierarchy.face, axis=0)
        del shared
    del own
    return push_pull(hierarchy, lights, gathered, state.emission, state.reflectance)


def relative_residual(state: SolverState, radiosity: Array) -> float:
    """Return Σ A |E + ρ K B − B| / Φ of the state's radiosity, given what it is reflected as."""
    leaves = state.hierarchy.leaves
    change = np.abs(radiosity[leaves] - state.radiosity[leaves])
    return float((state.hierarchy.area[leaves] @ change).max()) / state.power


def bounce(
    state: SolverState,
    links: Links,
    lights: Array,
    scale: Array | None = None,
    cluster_links: ClusterLinks | None = None,
    cut: ClusterCut | None = None,
) -> None:
    """Move the state's irradiance and radiosity on by one step (see `reflect`), and count it.

    The step's change at the leaves is taken as the residual, that of the radiosity before.
    """
    state.irradiance = state.irradiance[:0]  # the step does not need it, and memory is short
    irradiance, radiosity = reflect(state, links, lights, scale, cluster_links, cut)
    state.residual = relative_residual(state, radiosity)
    state.irradiance, state.radiosity = irradiance, radiosity
    state.iterations += 1
