"""The residual r(x) on the floor of a cube: what each assembly makes zero, and what remains."""

from __future__ import annotations

import drawing
import numpy as np
import scenes
from matplotlib.figure import Figure
from measures import solved

from radiosity_addon.solver.gather.residual import CONSTANT, DELTA, Residual

NAMES = {
    "galerkin": "Galerkin, constant",
    "collocation": "collocation, constant",
    "linear": "collocation, linear",
}


def figure(small: bool) -> Figure:
    """Solve with each assembly on the same elements, and evaluate r on a grid of the floor."""
    scene, _ = scenes.cube(0.5)
    side = 16 if small else 64
    drawn, panels = drawing.axes(3, 8.6, 3.0)
    place = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(place, place)
    # The floor's two triangles are (0 0, 1 0, 1 1) and (0 0, 1 1, 0 1).
    lower = (y < x).ravel()
    weights = np.where(
        lower[:, None], np.stack([x - y, y], -1).reshape(-1, 2), np.stack([x, y - x], -1).reshape(-1, 2)
    )
    size = {}
    for panel, (assembly, name) in zip(panels, NAMES.items(), strict=True):
        state = solved(scene, method="dense", assembly=assembly, elements=48 if small else 192)
        residual = Residual(state)
        face = residual.front_of(np.where(lower, 0, 1))
        r = residual.at(face, weights)[:, 0].reshape(side, side)
        size[assembly] = float(np.abs(r).mean())
        image = panel.imshow(1e3 * r, origin="lower", extent=(0, 1, 0, 1), cmap="RdBu_r", vmin=-15, vmax=15)
        leaves = state.hierarchy.leaves
        corners = state.hierarchy.corners[leaves[state.hierarchy.normal[leaves, 2] > 0.5]]
        panel.triplot(
            *corners[..., :2].reshape(-1, 2).T, np.arange(3 * len(corners)).reshape(-1, 3), color="k", lw=0.3
        )
        panel.set(xticks=[], yticks=[])
        panel.grid(visible=False)
        panel.set_title(f"{name}\nmean |r| = {1e3 * size[assembly]:.2f} mW/m²", fontsize=8)
        if assembly == "collocation":
            # Zero at every centroid (3.8), but not in the mean.
            assert residual.norm(DELTA).max() < 1e-9
            assert residual.norm(CONSTANT)[0] > 1e-4
        if assembly == "galerkin":
            # Zero in the mean of every element (3.18), up to the cubature of the test; not at centroids.
            assert residual.norm(CONSTANT)[0] < 0.1 * residual.norm(CONSTANT, splits=1)[0]
            assert residual.norm(DELTA)[0] > 1e-3
    assert (r < 0.0).mean() > 0.9  # the linear elements' own
    assert size["linear"] < (1.0 if small else 0.6) * min(size["galerkin"], size["collocation"]), size
    drawn.colorbar(image, ax=panels, label="r [mW/m²]", shrink=0.8)
    return drawn
