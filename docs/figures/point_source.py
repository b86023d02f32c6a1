"""A point lamp over a floor: the inverse square law and the cosine law, from the solver's own lamp."""

from __future__ import annotations

import drawing
import numpy as np
from matplotlib.figure import Figure

from radiosity_addon.numerics.radiometry import intensity_of_flux, irradiance_from_point
from radiosity_addon.solver import PointLight

FLUX = 100.0
HEIGHT = 2.0


def figure(small: bool) -> Figure:
    """Compare the lamp's irradiance with I cosθ/r², below it and along the floor."""
    lamp = PointLight((0.0, 0.0, 0.0), FLUX)
    up = np.array([0.0, 0.0, 1.0])
    intensity = intensity_of_flux(FLUX)
    count = 12 if small else 40

    below = np.geomspace(0.25, 16.0, count)
    points = -below[:, None] * up
    facing = FLUX * lamp.unit_irradiance(points, np.broadcast_to(up, points.shape))
    np.testing.assert_allclose(facing, irradiance_from_point(intensity, np.ones(count), below), rtol=1e-9)

    along = np.linspace(-6.0, 6.0, count)
    points = np.stack([along, np.zeros(count), np.full(count, -HEIGHT)], axis=1)
    floor = FLUX * lamp.unit_irradiance(points, np.broadcast_to(up, points.shape))
    distance = np.hypot(along, HEIGHT)
    np.testing.assert_allclose(
        floor, irradiance_from_point(intensity, HEIGHT / distance, distance), rtol=1e-9
    )
    # On a plane the two laws join to cos³: half the light is left where cosθ = 0.5^(1/3).
    half = HEIGHT * np.tan(np.arccos(0.5 ** (1 / 3)))

    drawn, (left, right) = drawing.axes(2, 7.2, 2.9)
    left.loglog(below, facing, "o", markersize=3, label="the solver's lamp")
    left.loglog(below, intensity / below**2, color=drawing.ORANGE, label=r"$I/r^2$")
    left.set(xlabel="distance below the lamp [m]", ylabel=r"irradiance [W/m²]", title="inverse square law")
    left.legend()
    right.plot(along, floor, "o", markersize=3, label="the solver's lamp")
    right.plot(along, intensity * HEIGHT / distance**3, color=drawing.ORANGE, label=r"$I\cos\theta/r^2$")
    right.axvline(half, color=drawing.GRAY, linestyle="--", linewidth=1)
    right.annotate(
        "half as bright", (half, floor.max() * 0.8), xytext=(4, 0), textcoords="offset points", color="0.4"
    )
    right.set(
        xlabel=f"place on a floor {HEIGHT:g} m below [m]", title=r"with the cosine law: $\propto\cos^3\theta$"
    )
    right.legend(loc="upper left", fontsize=7)
    return drawn
