"""The links of the multi-level hierarchy in the Cornell box, by the level of their receivers."""

from __future__ import annotations

from itertools import pairwise

import drawing
import numpy as np
import painting
import scenes
from matplotlib.figure import Figure
from measures import solved

from radiosity_addon.solver.hierarchy.nodes import Hierarchy

LEVELS = (0, 1, 2, 3)
FORM_FACTOR_ERROR = 0.1


def figure(small: bool) -> Figure:
    """Solve, and draw the links of each level between the centers of their ends."""
    scene = scenes.cornell_box()
    min_area = 4e-3 if small else 2.5e-4
    state = solved(scene, method="multi-level", form_factor_error=FORM_FACTOR_ERROR, min_area=min_area)
    hierarchy, links = state.hierarchy, state.links
    source = links.source - hierarchy.n_clusters
    level = hierarchy.level[links.receiver]
    exchange = links.factor * links.visibility * hierarchy.area[links.receiver]
    check(hierarchy, links.receiver, source, exchange, min_area * hierarchy.faces.area.sum())

    center = hierarchy.corners.mean(axis=1)
    leaves = hierarchy.leaves
    colors = 0.3 + 0.7 * painting.display(state.radiosity[leaves], exposure=1.5)
    shown = [depth for depth in LEVELS if (level == depth).any()]
    drawn, axes = drawing.plt.subplots(1, len(shown), figsize=(2.5 * len(shown), 2.8), squeeze=False)
    for panel, depth in zip(axes[0], shown, strict=True):
        chosen = np.flatnonzero(level == depth)
        picked = chosen[np.linspace(0, len(chosen) - 1, min(len(chosen), 500)).astype(int)]
        painting.paint(panel, hierarchy, leaves, colors, edges=0.15)
        painting.lines(panel, center[source[picked]], center[links.receiver[picked]], "#103060", 0.4, 0.5)
        share = exchange[chosen].sum() / exchange.sum()
        panel.set_title(f"receivers of level {depth}:\n{len(chosen)} links, {share:.0%} of AFV", fontsize=8)
    drawn.suptitle(f"{len(links)} links, {len(leaves)} leaves (at most 500 links drawn in each)", fontsize=8)
    # A matrix of the leaves would have many times as many entries.
    assert len(links) < (0.8 if small else 0.02) * len(leaves) ** 2, (len(links), len(leaves))
    # From level 1 on (faces themselves differ in size) each level's links carry less.
    carried = [exchange[level == depth].mean() for depth in shown[1:]]
    assert all(coarser > finer for coarser, finer in pairwise(carried)), carried
    return drawn


def check(
    hierarchy: Hierarchy, receiver: np.ndarray, source: np.ndarray, exchange: np.ndarray, min_area: float
) -> None:
    """Assert what Oracle1 promises: no link that could be refined takes F_ε of its source's light."""
    may_split = (hierarchy.area[receiver] >= 4 * min_area) | (hierarchy.area[source] >= 4 * min_area)
    factor_of_source = exchange / hierarchy.area[source]
    assert factor_of_source[may_split].max() < FORM_FACTOR_ERROR
