"""The elements of the Cornell box at three thresholds BF_ε, colored by their radiosity."""

from __future__ import annotations

from itertools import pairwise

import drawing
import numpy as np
import painting
import scenes
from matplotlib.figure import Figure
from measures import solved

from radiosity_addon.solver import SolverState

ERRORS = (1e-2, 1e-3, 1e-4)


def figure(small: bool) -> Figure:
    """Solve at each threshold and paint the leaves."""
    scene = scenes.cornell_box()
    drawn, panels = drawing.axes(3, 9.0, 3.35)
    counts: list[int] = []
    means: list[float] = []
    for panel, error in zip(panels, ERRORS, strict=True):
        state = solved(scene, method="hierarchical", error=error)
        hierarchy, leaves = state.hierarchy, state.hierarchy.leaves
        # Leaves tile the faces, whatever their number.
        np.testing.assert_allclose(hierarchy.area[leaves].sum(), hierarchy.faces.area.sum(), rtol=1e-12)
        counts.append(len(leaves))
        means.append(mean_irradiance(state))
        colors = painting.display(state.radiosity[leaves])
        painting.paint(panel, hierarchy, leaves, colors, edges=0.25)
        exponent = round(np.log10(error))
        panel.set_title(
            rf"$BF_\varepsilon = 10^{{{exponent}}}\,\Phi$: {len(leaves)} leaves, {state.n_links} links"
        )
        if small and len(counts) == 2:
            break
    # Each tenth of the threshold costs a few times the leaves, not ten times as many.
    assert all(1.5 < finer / coarser < 8.0 for coarser, finer in pairwise(counts)), counts
    # What arrives in all is known from few elements: refining places it.
    np.testing.assert_allclose(means, means[-1], rtol=0.02)
    if not small:
        reference = mean_irradiance(solved(scene, method="hierarchical", error=1e-5))
        np.testing.assert_allclose(means, reference, rtol=0.02)
        np.testing.assert_allclose(means[1:], reference, rtol=0.003)
    return drawn


def mean_irradiance(state: SolverState) -> float:
    """Return the area mean over all leaves [W/m²], of the brightest channel."""
    leaves = state.hierarchy.leaves
    area = state.hierarchy.area[leaves]
    return float((area @ state.irradiance[leaves] / area.sum()).max())
