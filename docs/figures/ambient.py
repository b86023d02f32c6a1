"""The Cornell box as shooting brightens it, without and with the ambient term."""

from __future__ import annotations

import drawing
import numpy as np
import painting
import scenes
from matplotlib.figure import Figure
from measures import solved

from radiosity_addon.base import Progress
from radiosity_addon.solver import Scene, SolverSettings
from radiosity_addon.solver.methods.shooting import ShootingState, solve

STAGES = (20, 80, 320)


def figure(small: bool) -> Figure:
    """Shoot, and show some stages both ways."""
    scene = scenes.cornell_box()
    stages = STAGES[:2] if small else STAGES
    elements = 200 if small else 800
    states = shoot(
        scene, SolverSettings(method="shooting", elements=elements, max_iterations=max(stages)), stages
    )
    columns = len(stages) + 1
    drawn, axes = drawing.plt.subplots(2, columns, figsize=(2.3 * columns, 4.75), squeeze=False)
    # The end is not waited for: a matrix on the same elements knows it.
    final = solved(scene, method="conjugate-gradient", elements=elements)
    hierarchy, leaves = final.hierarchy, final.hierarchy.leaves
    plain = final.radiosity[leaves]
    area = hierarchy.area[leaves]
    emission = hierarchy.faces.emission[hierarchy.face[leaves]]
    whole = float((area @ (plain - emission))[0])
    errors = []
    for column, (shots, (without, with_ambient)) in enumerate(sorted(states.items())):
        for row, radiosity in enumerate((without, with_ambient)):
            painting.paint(axes[row, column], hierarchy, leaves, painting.display(radiosity))
            errors.append(float((area @ (radiosity - emission))[0]) / whole)
        axes[0, column].set_title(f"{shots} shots: {errors[-2]:.0%} of the\nreflected light")
        axes[1, column].set_title(f"with the ambient term: {errors[-1]:.0%}")
    painting.paint(axes[0, -1], hierarchy, leaves, painting.display(plain))
    axes[0, -1].set_title("in the end")
    axes[1, -1].axis("off")
    without, with_ambient = np.array(errors[0::2]), np.array(errors[1::2])
    # What is shown is nearer to the end with the term at every stage, and what is solved is the same.
    assert (abs(with_ambient - 1.0) < abs(without - 1.0)).all()
    assert (np.diff(without) > 0).all()
    return drawn


def shoot(scene: Scene, settings: SolverSettings, stages: tuple[int, ...]) -> dict[int, tuple]:
    """Return the shown radiosity of the leaves without and with the term, by shots."""
    kept: dict[int, tuple] = {}

    def look(state: ShootingState) -> None:
        if state.iterations in stages and state.iterations not in kept:
            kept[state.iterations] = picture(state)

    solve(scene, settings, Progress(lambda _: None, look=look))
    return kept


def picture(state: ShootingState) -> tuple:
    """Return the (l, 3) radiosity of the leaves as it is, and with the term."""
    shown = state.radiosity + state.reflectance * state.ambient()
    return state.radiosity[state.leaves], shown[state.leaves]
