"""How Jacobi, Gauss–Seidel, conjugate gradients and shooting converge, by reflectance."""

from __future__ import annotations

from collections.abc import Iterator

import drawing
import numpy as np
import scenes
from matplotlib.figure import Figure
from measures import assembled

from radiosity_addon.solver.equations.linear_system import LinearSystem
from radiosity_addon.solver.equations.matrix_report import matrix_properties
from radiosity_addon.solver.methods.conjugate_gradient import conjugate_gradient
from radiosity_addon.solver.methods.gauss_seidel import gauss_seidel
from radiosity_addon.solver.methods.jacobi import jacobi

SMALL_ENOUGH = 1e-6

TABLE = {0.5: (19, 11, 7), 0.8: (61, 32, 10), 0.95: (269, 136, 12)}
"""Iterations of Jacobi, Gauss–Seidel and conjugate gradients, as quoted on the page."""


def figure(small: bool) -> Figure:
    """Iterate on one system a reflectance; count iterations to a millionth of the light."""
    elements = 150 if small else 400
    reflectances = (0.8,) if small else (0.5, 0.8, 0.95)
    drawn, panels = drawing.axes(len(reflectances), 9.0, 3.1)
    for panel, reflectance in zip(panels, reflectances, strict=True):
        system = assembled(scenes.cube(reflectance)[0], elements)
        light = float((system.area @ system.emission)[0])
        counts = {}
        methods = {"Jacobi": jacobi, "Gauss–Seidel": gauss_seidel, "conjugate gradients": conjugate_gradient}
        for name, method in methods.items():
            history = until_small(method(system), light)
            panel.semilogy(history, ".-", markersize=3, label=name)
            counts[name] = len(history) - 1
        history = shots(system, light)
        panel.semilogy(np.arange(len(history)) / len(system), history, label="shooting, n shots")
        counts["shooting"] = (len(history) - 1) / len(system)
        check(system, reflectance, counts)
        panel.set(ylim=(SMALL_ENOUGH, 2.0), xlabel="iterations", title=rf"$\rho$ = {reflectance}")
        panel.set_xlim(0, 1.02 * counts["Jacobi"])
    panels[0].set_ylabel(r"residual $\Sigma A|E - KB|\,/\,\Phi$")
    panels[0].legend(fontsize=7, loc="upper right")
    return drawn


def until_small(iterates: Iterator, light: float) -> list[float]:
    """Return the relative residual of every iterate down to `SMALL_ENOUGH`."""
    history = []
    for _, power in iterates:
        history.append(float(power[0]) / light)
        if history[-1] < SMALL_ENOUGH:
            break
    return history


def shots(system: LinearSystem, light: float) -> list[float]:
    """Return ΣAΔB / Φ after every shot, from the largest unshot power on."""
    unshot = system.emission[:, 0].copy()
    gain = system.reflectance[:, 0] / system.area
    history = [float(system.area @ unshot) / light]
    while history[-1] > SMALL_ENOUGH:
        source = int(np.argmax(system.area * unshot))
        sent, unshot[source] = unshot[source], 0.0
        unshot += gain * system.exchange[:, source] * sent
        history.append(float(system.area @ unshot) / light)
    return history


def check(system: LinearSystem, reflectance: float, counts: dict[str, float]) -> None:
    """Assert the order of the methods and Jacobi's rate."""
    radius = matrix_properties(system).spectral_radius
    np.testing.assert_allclose(radius, reflectance, rtol=0.02)  # closed and of one color
    # Jacobi starts with a residual of ρ and multiplies it by the spectral radius.
    predicted = np.log(SMALL_ENOUGH / reflectance) / np.log(radius)
    np.testing.assert_allclose(counts["Jacobi"], predicted, rtol=0.1, atol=1.5)
    assert counts["Gauss–Seidel"] < 0.75 * counts["Jacobi"]
    assert counts["conjugate gradients"] < counts["Gauss–Seidel"]
    if reflectance >= 0.8:
        assert counts["conjugate gradients"] < 0.25 * counts["Jacobi"]
    assert counts["shooting"] < counts["Jacobi"]
    told = [counts[name] for name in ("Jacobi", "Gauss–Seidel", "conjugate gradients")]
    np.testing.assert_allclose(told, TABLE[reflectance], atol=1.0)
