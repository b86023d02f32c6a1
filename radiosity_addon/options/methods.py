"""The methods of solving. Which options each of them has is said by the options, in `BakeSettings`."""

from __future__ import annotations

from typing import NamedTuple


class Method(NamedTuple):
    """One way to solve the radiosity equation: for people to choose by."""

    label: str
    description: str


METHODS = {
    "hierarchical": Method(
        "Hierarchical",
        "Links between elements of every size, refined where they may be wrong: the fastest at equal error",
    ),
    "multi-level": Method(
        "Multi-Level", "Links between elements of every size, refined beforehand by their form factors"
    ),
    "two-level": Method("Two-Level", "Large patches send, small elements inside them receive"),
    "shooting": Method(
        "Shooting", "The brightest element sends its light, then the next: shows the scene as it brightens"
    ),
    "conjugate-gradient": Method(
        "Conjugate Gradients", "A full matrix, solved by conjugate gradients on its symmetric form"
    ),
    "gauss-seidel": Method("Gauss-Seidel", "A full matrix, each element gathering the newest radiosities"),
    "jacobi": Method("Jacobi", "A full matrix, all elements gathering at once: one bounce per iteration"),
    "dense": Method("Dense", "A full matrix, solved directly: exact for its elements"),
}

ALL = tuple(METHODS)
LINKS = ("hierarchical", "multi-level")
"""Methods with links between elements of every size."""

MATRIX = ("conjugate-gradient", "gauss-seidel", "jacobi", "dense")
"""Methods with a full matrix."""

ITERATIVE = ("hierarchical", "multi-level", "shooting", "conjugate-gradient", "gauss-seidel", "jacobi")

SYMMETRIC_ONLY = frozenset({"conjugate-gradient"})
"""Methods that need a system which reciprocity makes symmetric: Galerkin's."""
