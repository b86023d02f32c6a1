"""The linear system K B = E of the radiosity equation on finite elements.

    K = M − P F                                                     (handout (3.33))

M is the mass matrix (the identity for constant elements), P = diag(ρ) and F the form factors.
Only ρ and E differ between the channels, so one system holds all three.

What is stored is T = A F, the *exchange areas* A_i F_ij [m²]: where they are reciprocal, T is
symmetric bit for bit, which F = T / A is not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics import Array


@dataclass(frozen=True)
class LinearSystem:
    """K B = E for n unknowns and three channels (handout (3.32)).

    exchange (n, n): T_ij = A_i F_ij V_ij [m²], visibility included.
    reflectance (n, 3).
    emission (n, 3): Emission plus the reflected light of the lamps [W/m²].
    area (n,): A_i = ∫ N_i dA > 0 [m²], the weight of each unknown and of its equation.
    mass (n, n): M; None is the identity.
    reciprocal: Whether T is symmetric by construction: area-averaged factors, one for each pair.
    """

    exchange: Array
    reflectance: Array
    emission: Array
    area: Array
    mass: Array | None = None
    reciprocal: bool = False

    def __post_init__(self) -> None:
        count = len(self.area)
        for name, shape in (
            ("exchange", (count, count)),
            ("reflectance", (count, 3)),
            ("emission", (count, 3)),
            ("mass", (count, count)),
        ):
            value = getattr(self, name)
            if value is not None and value.shape != shape:
                raise ValueError(f"{name} has shape {value.shape}; {shape} is needed")

    def __len__(self) -> int:
        return len(self.area)

    @property
    def transport(self) -> Array:
        """(n, n) float64, a new array: F, the form factors with visibility."""
        return np.asarray(self.exchange / self.area[:, None])

    def gather(self, radiosity: Array) -> Array:
        """Return F B: the irradiance the surfaces send one another, (n, k) for (n, k) [W/m²]."""
        return np.asarray((self.exchange @ radiosity) / self.area[:, None])

    def weigh(self, radiosity: Array) -> Array:
        """Return M B, (n, k) for (n, k): the values at the nodes, for constant elements B itself."""
        return radiosity if self.mass is None else np.asarray(self.mass @ radiosity)

    def residual(self, radiosity: Array) -> Array:
        """Return E − K B [W/m²], (n, 3): the residual of (3.7); the negative of r(x) at the nodes."""
        reflected = self.reflectance * self.gather(radiosity)
        return np.asarray(self.emission + reflected - self.weigh(radiosity))

    def residual_power(self, radiosity: Array) -> Array:
        """Return (3,) Σ A |E − K B| [W]: the norm (3.7) with areas for weights."""
        return np.asarray(self.area @ np.abs(self.residual(radiosity)))

    def diagonal(self) -> Array:
        """Return (n, 3) K_ii of every channel: 1 for planar constant elements."""
        mass = 1.0 if self.mass is None else np.diagonal(self.mass)[:, None]
        own = np.diagonal(self.exchange) / self.area
        return np.asarray(mass - self.reflectance * own[:, None])

    def matrix(self, channel: int) -> Array:
        """Return (n, n) K = M − P F of one channel, a new array."""
        matrix = self.exchange * (-self.reflectance[:, channel] / self.area)[:, None]
        if self.mass is None:
            matrix[np.diag_indices(len(self))] += 1.0
        else:
            matrix += self.mass
        return np.asarray(matrix)

    def take(self, rows: Array) -> LinearSystem:
        """Return the system of selected unknowns among themselves, without the light of the others.

        A copy, except for all rows in order, which is the system itself.
        """
        if np.array_equal(rows, np.arange(len(self))):
            return self
        square = np.ix_(rows, rows)
        return LinearSystem(
            self.exchange[square],
            self.reflectance[rows],
            self.emission[rows],
            self.area[rows],
            None if self.mass is None else self.mass[square],
            self.reciprocal,
        )
