"""Shooting against gathering in the Cornell box: the same relaxations in another order."""

from __future__ import annotations

import drawing
import numpy as np
import scenes
from matplotlib.figure import Figure
from measures import assembled

from radiosity_addon.solver.equations.linear_system import LinearSystem

ROUNDS = 3


def figure(small: bool) -> Figure:
    """Relax one row after another from S = 0, cyclically and by the largest unshot power."""
    system = assembled(scenes.cornell_box(), 200 if small else 900)
    n = len(system)
    cyclic = relax(system, by_power=False)
    power = relax(system, by_power=True)
    jacobi = relax_all(system)
    # The claim: at no cost is the residual of shooting above that of gathering in cycles.
    assert (power <= cyclic * (1 + 1e-12)).all()
    shots, gathers = int(np.argmax(power < 0.5)), int(np.argmax(cyclic < 0.5))
    assert 0 < shots < 12
    assert shots < (0.25 if small else 0.05) * gathers
    assert power[n] < 0.4 * cyclic[n]
    assert (power[n::n] < jacobi[1 : ROUNDS + 1]).all()

    drawn, (left, right) = drawing.axes(2, 8.4, 3.1)
    for panel, until in ((left, n), (right, ROUNDS * n)):
        steps = np.arange(until + 1)
        panel.semilogy(steps / n, cyclic[: until + 1], label="gathering, row after row (Gauss–Seidel)")
        panel.semilogy(steps / n, power[: until + 1], label="shooting, largest unshot power first")
        sweeps = np.arange(int(until / n) + 1)
        panel.semilogy(
            sweeps, jacobi[: len(sweeps)], "o", markersize=4, label="gathering, all at once (Jacobi)"
        )
        panel.set(xlabel="rows or columns used / n", ylim=(power[until] * 0.8, 1.3))
    left.set_title(f"at first: half is left after {shots} shots, or {gathers} gathers", fontsize=8)
    right.set_title(f"{ROUNDS} rounds of {n} elements", fontsize=8)
    left.set_ylabel(r"residual $\Sigma A|E - KS|\,/\,\Phi$")
    right.legend(fontsize=7)
    return drawn


def relax(system: LinearSystem, by_power: bool) -> np.ndarray:
    """Return Σ A |E − K S| / Φ after every relaxation of one row of S, from S = 0 on (red)."""
    reflectance = system.reflectance[:, 0] / system.area
    residual = system.emission[:, 0].copy()
    light = system.area @ residual
    history = [1.0]
    for step in range(ROUNDS * len(system)):
        row = int(np.argmax(system.area * residual)) if by_power else step % len(system)
        change, residual[row] = residual[row], 0.0
        residual += reflectance * system.exchange[:, row] * change
        history.append(float(system.area @ residual / light))
    return np.array(history)


def relax_all(system: LinearSystem) -> np.ndarray:
    """Return the same after every sweep that relaxes all rows at once."""
    radiosity = np.zeros_like(system.emission)
    light = system.area @ system.emission[:, 0]
    history = []
    for _ in range(ROUNDS + 1):
        history.append(float(system.residual_power(radiosity)[0] / light))
        radiosity = radiosity + system.residual(radiosity)
    return np.array(history)
