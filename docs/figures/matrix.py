"""The matrix of two rooms, and what its iteration depends on: spectral radius and condition by ρ."""

from __future__ import annotations

import drawing
import numpy as np
import scenes
from matplotlib.figure import Figure
from measures import assembled

from radiosity_addon.solver import Scene
from radiosity_addon.solver.equations.decomposition import independent_sets
from radiosity_addon.solver.equations.matrix_report import matrix_properties, symmetric_form


def figure(small: bool) -> Figure:
    """Draw |K| of two closed rooms, and measure a cube's matrix at several reflectances."""
    drawn, (left, right) = drawing.axes(2, 8.0, 3.3)
    first, _ = scenes.box()
    second = first * (0.8, 1.0, 0.7) + (2.0, 3.0, 5.0)
    triangles = np.concatenate([first, second])
    rooms = Scene(triangles, np.full((24, 3), 0.5), np.ones((24, 3)))
    system = assembled(rooms, 48 if small else 192)
    sets, alone = independent_sets(system)
    assert len(sets) == 2
    assert len(alone) == 0
    rows = np.concatenate(sets)
    matrix = np.abs(system.matrix(0))[np.ix_(rows, rows)]
    # The rooms do not see each other, nor do elements of one wall: blocks, with holes.
    here, there = len(sets[0]), len(sets[1])
    assert not matrix[:here, here:].any()
    assert not matrix[here:, :here].any()
    properties = matrix_properties(system)
    assert 0.35 < properties.fill < 0.5, properties.fill
    matrix[np.diag_indices(len(matrix))] = 0.0
    left.imshow(np.where(matrix > 0, np.log10(np.maximum(matrix, 1e-6)), np.nan), cmap="viridis", vmin=-4)
    left.axhline(here - 0.5, color="k", linewidth=0.6)
    left.axvline(here - 0.5, color="k", linewidth=0.6)
    left.grid(visible=False)
    left.set(xticks=[], yticks=[])
    left.set_title(f"two rooms, {here} + {there} elements: {properties.fill:.0%} of K is not 0")

    values = np.array([0.3, 0.8]) if small else np.array([0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95])
    radius, condition = [], []
    for reflectance in values:
        cube = assembled(scenes.cube(float(reflectance))[0], 48)
        measured = matrix_properties(cube)
        # Diagonal dominance (3.34): what is left of 1 in a row is 1 − ρ.
        np.testing.assert_allclose(measured.dominance, 1.0 - reflectance, atol=2e-3)
        radius.append(measured.spectral_radius)
        condition.append(measured.condition)
        exact = np.linalg.cond(balanced(symmetric_form(cube, 0)[0]))
        np.testing.assert_allclose(measured.condition, exact, rtol=0.02)
    np.testing.assert_allclose(radius, values, rtol=2e-3)
    bound = (1 + values) / (1 - values)
    assert (np.array(condition) <= bound * 1.001).all()
    right.semilogy(values, bound, "--", color=drawing.GRAY, label=r"$(1+\rho)/(1-\rho)$")
    right.semilogy(values, condition, "o-", label="condition, symmetrized")
    right.semilogy(values, np.log(1e-6) / np.log(values), "s-", label="Jacobi iterations for 10⁻⁶")
    right.set(xlabel=r"reflectance $\rho$")
    right.legend(fontsize=7)
    return drawn


def balanced(matrix: np.ndarray) -> np.ndarray:
    """Return a symmetric matrix scaled to a diagonal of 1."""
    scale = 1.0 / np.sqrt(np.diagonal(matrix))
    return scale[:, None] * matrix * scale
