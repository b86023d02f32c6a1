"""A closed room of one color: each bounce adds a power of ρ, and all of them E/(1 − ρ)."""

from __future__ import annotations

import drawing
import numpy as np
import scenes
from matplotlib.figure import Figure
from measures import solved

from radiosity_addon.solver import Scene


def figure(small: bool) -> Figure:
    """Solve the room with light on every wall, and set the series of bounces against it."""
    drawn, (panel,) = drawing.axes(1, 5.4, 3.0)
    triangles, _ = scenes.box((2.0, 1.0, 1.0))
    emission = np.ones((len(triangles), 3))
    bounces = np.arange(0, 41)
    for reflectance, color in zip((0.5,) if small else (0.3, 0.5, 0.7, 0.9), drawing.CYCLE, strict=False):
        scene = Scene(triangles, np.full((len(triangles), 3), reflectance), emission)
        state = solved(scene, method="hierarchical", error=1e-3, tolerance=1e-7)
        leaves = state.hierarchy.leaves
        # The room is closed: the same everywhere, whatever its shape.
        mean = state.hierarchy.area[leaves] @ state.radiosity[leaves, 0] / state.hierarchy.area[leaves].sum()
        np.testing.assert_allclose(mean, 1.0 / (1.0 - reflectance), rtol=2e-3)
        series = np.cumsum(reflectance**bounces)
        panel.plot(bounces, series, ".-", color=color, markersize=4, label=rf"$\rho$ = {reflectance}")
        panel.plot(41.5, mean, "D", color=color, markersize=5, clip_on=False)
        # What is missing after k bounces is ρ^(k+1) of the whole.
        np.testing.assert_allclose(
            1.0 - series * (1.0 - reflectance), reflectance ** (bounces + 1), atol=1e-12
        )
    panel.set(xlabel="bounces counted", ylabel="radiosity / emission", xlim=(0, 42))
    panel.set_title("lines: the series of bounces; diamonds: the solver, all bounces", fontsize=8)
    panel.legend()
    return drawn
