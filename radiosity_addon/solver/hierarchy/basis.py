"""Basis functions over the leaves, of which the approximate radiosity B̂ is a sum (handout §3.1).

    B̂(x) = Σ_i B_i N_i(x)                                            (handout (3.1))

On every leaf B̂ is linear between the unknowns at its three corners. Constant elements (3.2)
are the case that all three are the same unknown; hats (`vertex_basis`) share theirs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics import Array
from .nodes import Hierarchy

INTERPOLATION_ROUNDS = 24
"""Enough for rounding, as nodes move by little (`vertex_basis.INWARD`)."""


@dataclass(frozen=True)
class Basis:
    """n basis functions on l leaves, and the node of each.

    leaf (l,) int: The leaf elements, `Hierarchy.leaves`.
    corner (l, 3) int32: The unknown at each corner of each leaf.
    home (n,) int: The row of a leaf that holds node x_i; it gives the unknown's normal, ρ and E.
    place (n, 3): Barycentric weights of x_i in that leaf.
    area (n,): ∫ N_i dA [m²]
    """

    leaf: Array
    corner: Array
    home: Array
    place: Array
    area: Array

    def __len__(self) -> int:
        return len(self.area)

    @property
    def is_constant(self) -> bool:
        """Whether every leaf has one unknown of its own."""
        return len(self) == len(self.leaf) and bool((self.corner == self.corner[:, :1]).all())

    def points(self, hierarchy: Hierarchy) -> Array:
        """Return (n, 3) the nodes x_i."""
        corners = hierarchy.corners[self.leaf[self.home]]
        return np.asarray(np.einsum("nc,nck->nk", self.place, corners))

    def elements(self) -> Array:
        """Return (n,) the leaf element of each node, whose ρ and E the unknown has."""
        return np.asarray(self.leaf[self.home])

    def faces(self, hierarchy: Hierarchy) -> Array:
        """Return (n,) the face of each node."""
        return np.asarray(hierarchy.face[self.elements()])

    def mass(self) -> Array | None:
        """Return M_ij = N_j(x_i), (n, n) float64, or None where it is the identity (3.9)."""
        if self.is_constant:
            return None
        matrix = np.zeros((len(self), len(self)))
        for corner in range(3):
            np.add.at(matrix, (np.arange(len(self)), self.corner[self.home, corner]), self.place[:, corner])
        return matrix

    def evaluate(self, values: Array, row: Array, barycentric: Array) -> Array:
        """Return B̂ at points of leaves (3.1).

        values (n, k): B_i of every unknown.
        row (m,) int: Rows of `leaf`.
        barycentric (m, 3): Weights of the leaf's corners.
        Returns function (m, k).
        """
        return np.asarray(np.einsum("mc,mck->mk", barycentric, values[self.corner[row]]))

    def from_nodes(self, at_nodes: Array) -> Array:
        """Return the (n, k) unknowns whose function takes given values at the nodes: M⁻¹ times them."""
        values = at_nodes
        if self.is_constant:
            return values
        # M differs from the identity by a small part, which each round takes once more.
        for _ in range(INTERPOLATION_ROUNDS):
            values = values + (at_nodes - self.evaluate(values, self.home, self.place))
        return values

    def leaf_means(self, values: Array) -> Array:
        """Return (l, k) the area mean of Σ B_i N_i over every leaf, for (n, k) values."""
        return np.asarray(values[self.corner].mean(axis=1))


def constant_basis(hierarchy: Hierarchy) -> Basis:
    """Return one function for each leaf: 1 on it and 0 elsewhere, nodes at the centroids (3.2)."""
    leaf = hierarchy.leaves
    row = np.arange(len(leaf))
    corner = np.repeat(row[:, None], 3, axis=1).astype(np.int32)
    return Basis(leaf, corner, row, np.full((len(leaf), 3), 1.0 / 3.0), hierarchy.area[leaf])
