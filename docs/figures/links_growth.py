"""How links grow with elements: the multi-level hierarchy's against the matrix's n²."""

from __future__ import annotations

import drawing
import numpy as np
import scenes
from matplotlib.figure import Figure
from measures import order, solved


def figure(small: bool) -> Figure:
    """Lower F_ε step by step in a cube, and count leaves and links."""
    scene, _ = scenes.cube(0.5)
    thresholds = 0.1 * 0.5 ** np.arange(4 if small else 7)
    leaves, links = [], []
    for threshold in thresholds:
        state = solved(
            scene, method="multi-level", form_factor_error=threshold, min_area=1e-6, tolerance=0.01
        )
        leaves.append(len(state.hierarchy.leaves))
        links.append(len(state.links))
    n = np.array(leaves, dtype=float)
    exponent = order(n, links)
    assert 0.7 < exponent <= 1.15, exponent
    assert (np.array(links) < 12 * n).all()
    drawn, (panel,) = drawing.axes(1, 5.0, 3.0)
    # Elements that do not face each other make no entry: those of one wall of six.
    panel.loglog(n, n**2 * 5 / 6, "--", color=drawing.GRAY, label=r"entries of the matrix, $\frac{5}{6}n^2$")
    panel.loglog(n, links, "o", label=rf"links: $\propto n^{{{exponent:.2f}}}$")
    panel.loglog(
        n, np.exp(np.polyval(np.polyfit(np.log(n), np.log(links), 1), np.log(n))), color=drawing.BLUE
    )
    panel.set(xlabel="leaf elements n", ylabel="links")
    panel.legend()
    return drawn
