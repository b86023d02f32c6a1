"""The three assemblies as elements grow finer: the floor of a cube with an emitting ceiling."""

from __future__ import annotations

import drawing
import numpy as np
import scenes
from matplotlib.figure import Figure
from measures import leaf_mean, order, solved

FLOOR = 0.171219
"""Mean radiosity of the floor at ρ = 0.5: Galerkin's solutions with 192 and 768 elements, extrapolated."""

PUBLISHED = 0.17122
"""The same from Galerkin solutions of squares, extrapolated from grids of 4 to 20."""

NAMES = {
    "galerkin": "Galerkin, constant",
    "collocation": "collocation, constant",
    "linear": "collocation, linear",
}


def figure(small: bool) -> Figure:
    """Solve with each assembly at several sizes, and fit the order of the error in the element's edge."""
    np.testing.assert_allclose(FLOOR, PUBLISHED, rtol=3e-5)
    scene, wall = scenes.cube(0.5)
    counts = np.array([12, 48, 192] if small else [12, 48, 192, 768])
    edge = np.sqrt(6.0 / (counts / 2))
    drawn, (panel,) = drawing.axes(1, 5.2, 3.2)
    errors = {}
    for (assembly, name), marker in zip(NAMES.items(), "os^", strict=True):
        floors = []
        for count in counts:
            state = solved(scene, method="dense", assembly=assembly, elements=int(count))
            floors.append(leaf_mean(state, state.radiosity, wall == scenes.FLOOR)[0])
        errors[assembly] = np.abs(np.array(floors) / FLOOR - 1.0)
        rate = order(edge[1:], errors[assembly][1:])
        panel.loglog(edge, errors[assembly], marker + "-", markersize=4, label=f"{name}: order {rate:.1f}")
        assert 1.6 < rate < 2.2, (assembly, rate)
    drawing.slope(panel, (0.2, 0.7), 3e-4, 2.0, "edge²")
    # On the same elements the area averages are nearer to the truth than values at centroids.
    assert (errors["galerkin"] < 0.5 * errors["collocation"]).all()
    assert (errors["linear"] > errors["collocation"]).all()
    panel.set(xlabel="edge of the cells [edge of the cube]", ylabel="relative error of the floor's mean")
    panel.legend(fontsize=8)
    return drawn
