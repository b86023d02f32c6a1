"""The form factor between two unit squares face to face, by formula and by approximations."""

from __future__ import annotations

import drawing
import numpy as np
import scenes
from matplotlib.figure import Figure

from radiosity_addon.form_factors.formulas import disk_factor, triangle_to_triangle

HOWELL_C11 = {0.5: 0.4152532836, 1.0: 0.1998248957, 2.0: 0.0685895888}
"""Howell's catalog of configuration factors, C-11."""


def figure(small: bool) -> Figure:
    """Sum the triangles' factors, and compare with the catalog, one point, and the disk."""
    distances = np.array([0.5, 1.0, 2.0]) if small else np.unique([*np.geomspace(0.1, 16.0, 25), *HOWELL_C11])
    exact = np.array([square_factor(distance) for distance in distances])
    for distance, factor in HOWELL_C11.items():
        np.testing.assert_allclose(exact[distances == distance], factor, rtol=1e-4)
    up, down = np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, -1.0]])
    above = np.stack([np.zeros_like(distances), np.zeros_like(distances), distances], axis=1)
    disk = np.array([disk_factor(np.zeros((1, 3)), up, x[None], down, np.ones(1))[0] for x in above])
    point = 1.0 / (np.pi * distances**2)
    far = distances >= 10.0
    np.testing.assert_allclose(disk[far], exact[far], rtol=5e-3)
    assert (disk < 1.0).all()
    assert point[0] > 1.0  # one sample of the kernel has no bound

    drawn, (left, right) = drawing.axes(2, 7.4, 3.0)
    left.loglog(distances, exact, label="exact")
    left.loglog(distances, disk, "--", label="disk, one point")
    left.loglog(distances, point, ":", label=r"$\cos\theta\cos\theta'A/\pi r^2$, one point")
    left.plot(*zip(*HOWELL_C11.items(), strict=True), "o", color="k", markersize=4, label="catalog")
    left.set(xlabel="distance / edge", ylabel="form factor", ylim=(1e-3, 30))
    left.legend(fontsize=7)
    right.loglog(distances, abs(disk / exact - 1.0), "--", color=drawing.ORANGE, label="disk")
    right.loglog(distances, abs(point / exact - 1.0), ":", color=drawing.GREEN, label="one point")
    right.set(xlabel="distance / edge", ylabel="relative error")
    drawing.slope(right, (3.0, 14.0), 0.06, -2.0, "distance⁻²")
    right.legend(fontsize=7)
    return drawn


def square_factor(distance: float) -> float:
    """Return the factor between unit squares at a distance, as sums over their two triangles each."""
    lower = scenes.grid((-0.5, -0.5, 0.0), (1, 0, 0), (0, 1, 0))
    upper = scenes.grid((-0.5, -0.5, distance), (0, 1, 0), (1, 0, 0))
    pairs = triangle_to_triangle(np.repeat(lower, 2, axis=0), np.concatenate([upper, upper]))
    return float(pairs.sum() / 2.0)
