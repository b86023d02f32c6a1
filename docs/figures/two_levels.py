"""Two levels: few patches send, many elements receive, against the elements' own dense solution."""

from __future__ import annotations

import drawing
import numpy as np
import scenes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from measures import solved

from radiosity_addon.solver import SolverState


def figure(small: bool) -> Figure:
    """Solve with more and more patches, and measure the distance to the dense solution."""
    scene, _ = scenes.cube(0.8)
    elements = 192 if small else 768
    dense = solved(scene, method="dense", elements=elements)
    patches = [12, 48, elements] if small else [12, 48, 96, 192, 384, elements]
    elements_off, means_off, factors = [], [], []
    for number in patches:
        state = solved(scene, method="two-level", elements=elements, patches=number, contrast=1e9)
        elements_off.append(difference(*(by_place(one) for one in (state, dense))))
        means_off.append(difference(*(one.irradiance[: len(scene), 0] for one in (state, dense))))
        factors.append(len(state.patches) / elements)
    # One element a patch is the dense system; with fewer patches the error falls steadily to it.
    assert elements_off[-1] < 1e-12
    assert (np.diff(elements_off) < 0).all(), elements_off
    assert elements_off[1] < 0.02, elements_off
    assert (np.array(means_off) <= elements_off).all()

    drawn, (panel,) = drawing.axes(1, 5.2, 3.0)
    shown = slice(None, -1)
    panel.loglog(factors[shown], elements_off[shown], "o-", label="elements")
    panel.loglog(factors[shown], means_off[shown], "s-", label="means of whole faces")
    for x, y, number in zip(factors[shown], elements_off[shown], patches[shown], strict=True):
        panel.annotate(f"{number} patches", (x, y), xytext=(4, 4), textcoords="offset points", fontsize=7)
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.set(xlabel="form factors computed, of the dense method's", ylabel="difference from dense, relative")
    panel.set_title(f"cube with an emitting ceiling, ρ = 0.8, {elements} elements", fontsize=8)
    panel.legend()
    return drawn


def by_place(state: SolverState) -> np.ndarray:
    """Return the leaves' irradiance (red) in an order that does not depend on when they were made."""
    leaves = state.hierarchy.leaves
    center = state.hierarchy.corners[leaves].mean(axis=1).round(9)
    return np.asarray(state.irradiance[leaves[np.lexsort(center.T)], 0])


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Return the relative difference in quadratic mean; all elements have one area."""
    return float(np.linalg.norm(one - other) / np.linalg.norm(other))
