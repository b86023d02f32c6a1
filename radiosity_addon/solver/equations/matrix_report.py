"""Properties of a radiosity matrix: size, fill, dominance, spectral radius, condition (handout §3.4)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...numerics import Array
from .linear_system import LinearSystem

CHUNK_ROWS = 512
"""Rows processed together; bounds the temporaries to some 4 KB · n."""

POWER_STEPS = 100
POWER_TOLERANCE = 1e-6
"""The power iteration ends when its estimate changes by less than this part."""


@dataclass(frozen=True)
class MatrixProperties:
    """Properties of K, the least favorable channel's.

    size: n.
    fill: Share of K's n² entries that are not 0 in any channel; 0 where ρ_i = 0 or i and j do not see each
        other.
    dominance: min_i (|K_ii| − Σ_{j≠i} |K_ij|) / |K_ii|, see (3.34): 1 − ρ in an enclosure.
    spectral_radius: Of Jacobi's iteration matrix, P F for planar elements: the factor on the error
        per iteration in the long run. At most the largest ρ.
    condition: (1 − λ_min) / (1 − λ_max) with the extreme eigenvalues of that matrix: the condition of the
        symmetrized system, scaled to a diagonal of 1. Infinite if λ_max reaches 1.
    symmetrised: Size of the symmetric system (`symmetric_form`): rows with ρ > 0, in the channel with the
        most. The others are eliminated.
    asymmetry: max |T − Tᵀ| / max |T|: 0 where A_i F_ij = A_j F_ji (3.30).
    """

    size: int
    fill: float
    dominance: float
    spectral_radius: float
    condition: float
    symmetrised: int
    asymmetry: float

    def report(self) -> dict[str, Any]:
        """Return them as a dict of plain numbers; a condition without bound is None, as JSON has no ∞."""
        return {**asdict(self), "condition": self.condition if np.isfinite(self.condition) else None}


def matrix_properties(system: LinearSystem) -> MatrixProperties:
    """Measure a system; a few dozen products with the matrix, no second matrix."""
    low, high = extreme_eigenvalues(system)
    beyond = 1.0 - high
    condition = float(((1.0 - low) / np.where(beyond > 0, beyond, np.nan)).max()) if len(system) else 1.0
    return MatrixProperties(
        size=len(system),
        fill=filled_share(system),
        dominance=diagonal_dominance(system),
        spectral_radius=float(np.maximum(high, -low).max()) if len(system) else 0.0,
        condition=condition if np.isfinite(condition) else float("inf"),
        symmetrised=int((system.reflectance > 0).sum(axis=0).max()),
        asymmetry=asymmetry(system.exchange),
    )


def filled_share(system: LinearSystem) -> float:
    """Return the share of K's entries that are not 0 in any channel."""
    count = len(system)
    reflects = (system.reflectance > 0).any(axis=1)
    entries = 0
    for rows in _chunks(count):
        used = (system.exchange[rows] != 0) & reflects[rows, None]
        if system.mass is not None:
            used |= system.mass[rows] != 0
        else:
            used[np.arange(used.shape[0]), np.arange(rows.start, rows.stop)] = True
        entries += int(np.count_nonzero(used))
    return entries / max(count, 1) ** 2


def diagonal_dominance(system: LinearSystem) -> float:
    """Return min_i (|K_ii| − Σ_{j≠i} |K_ij|) / |K_ii| over rows and channels, see (3.34).

    Positive: Jacobi and Gauss–Seidel converge. 1 without unknowns.
    """
    diagonal = np.abs(system.diagonal())
    margin = 1.0
    for rows in _chunks(len(system)):
        for channel in range(3):
            scale = -(system.reflectance[rows, channel] / system.area[rows])[:, None]
            block = scale * system.exchange[rows]
            if system.mass is not None:
                block += system.mass[rows]
            block[np.arange(block.shape[0]), np.arange(rows.start, rows.stop)] = 0.0
            own = diagonal[rows, channel]
            margin = min(margin, float(((own - np.abs(block).sum(axis=1)) / own).min()))
    return margin


def extreme_eigenvalues(system: LinearSystem) -> tuple[Array, Array]:
    """Estimate the smallest and largest eigenvalue of Jacobi's iteration matrix I − D⁻¹ K.

    By power iteration, from B = 1 for the largest, in the inner product Σ (A/ρ) x y, in which P F
    is symmetric if reciprocal: the Rayleigh quotient then never exceeds the largest. (For other
    systems' complex eigenvalues it estimates the real part only.) The matrix is not negative for
    constant elements, so its largest eigenvalue is its spectral radius.

    Returns low, high (3,): Of each channel; 0 where nothing reflects.
    """
    count = len(system)
    if count == 0:
        return np.zeros(3), np.zeros(3)
    diagonal = system.diagonal()
    reflects = system.reflectance > 0
    weight = np.where(reflects, system.area[:, None] * diagonal, 0.0)
    weight /= np.where(reflects, system.reflectance, 1.0)

    def step(values: Array) -> Array:
        change = (system.reflectance * system.gather(values) - system.weigh(values)) / diagonal
        return np.asarray(np.where(reflects, values + change, 0.0))

    start = np.where(reflects, 1.0, 0.0)
    high = _power_iteration(step, start, weight, 0.5)
    rough = np.where(reflects, np.random.default_rng(0).uniform(-1.0, 1.0, (count, 3)), 0.0)
    # The far end of the spectrum, mirrored: λ_max − λ is largest at the smallest λ.
    drop = _power_iteration(lambda values: high * values - step(values), rough, weight, 0.0)
    return high - drop, high


def _power_iteration(step: Callable[[Array], Array], start: Array, weight: Array, shift: float) -> Array:
    """Return (3,) the eigenvalue of largest (λ + shift) by Rayleigh quotients in the `weight` product."""
    values = start
    estimate = np.zeros(3)
    for _ in range(POWER_STEPS):
        norm = np.sqrt(np.maximum((weight * values * values).sum(axis=0), 0.0))
        values = values / np.where(norm > 0, norm, 1.0)
        following = step(values)
        before, estimate = estimate, np.asarray((weight * values * following).sum(axis=0))
        if (np.abs(estimate - before) <= POWER_TOLERANCE * np.abs(estimate)).all():
            break
        values = following + shift * values
    return estimate


def asymmetry(matrix: Array) -> float:
    """Return max |a_ij − a_ji| / max |a_ij| of a square matrix; 0 for an empty or zero one."""
    largest = difference = 0.0
    for rows in _chunks(len(matrix)):
        block = matrix[rows]
        largest = max(largest, float(np.abs(block).max()))
        difference = max(difference, float(np.abs(block - matrix[:, rows].T).max()))
    return difference / largest if largest > 0 else 0.0


def reciprocity_error(area: Array, transport: Array) -> float:
    """Return max |A_i F_ij − A_j F_ji| / max A_i F_ij: the deviation of form factors from (3.30).

    area (n,).
    transport (n, n).
    """
    return asymmetry(np.asarray(area)[:, None] * transport)


def symmetric_form(system: LinearSystem, channel: int) -> tuple[Array, Array, Array]:
    """Scale row i by A_i/ρ_i, which makes a reciprocal system symmetric: (A/ρ − A F) B = A E/ρ.

    (The handout scales by A_i alone, which suffices for uniform ρ only.) Rows with ρ = 0 have
    B = E and move to the right side. For constant elements.

    Returns matrix (m, m) [m²].
    Returns right_side (m,) [W].
    Returns rows (m,) int: The unknowns that remain: those with ρ > 0.
    """
    if system.mass is not None:
        raise ValueError("the symmetric form needs constant elements: a mass matrix M = 1")
    reflectance = system.reflectance[:, channel]
    rows, black = np.flatnonzero(reflectance > 0), np.flatnonzero(reflectance == 0)
    scale = system.area[rows] / reflectance[rows]
    matrix = -system.exchange[np.ix_(rows, rows)]
    matrix[np.diag_indices(len(rows))] += scale
    emission = system.emission[:, channel]
    right_side = scale * emission[rows] + system.exchange[np.ix_(rows, black)] @ emission[black]
    return matrix, right_side, rows


def _chunks(count: int) -> list[slice]:
    """Return slices of `CHUNK_ROWS` rows that cover 0 … count."""
    return [slice(start, min(start + CHUNK_ROWS, count)) for start in range(0, count, CHUNK_ROWS)]
