"""Independent sets: parts of a scene that exchange no light, solved separately (handout §3.4).

They are the connected components of "sees". In their order K is block diagonal: what happens
in one room is nothing to the other.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...numerics import Array
from .linear_system import LinearSystem

CHUNK_ROWS = 512
"""Rows of the matrix processed together; bounds the temporaries to 512 n bytes."""


def independent_sets(system: LinearSystem) -> tuple[list[Array], Array]:
    """Find the connected components of "sees", the graph of the entries of T and M that are not 0.

    Returns sets list of (k,) int: Rows of each component of two unknowns or more, in order; the first row's
        set first.
    Returns alone (a,) int: Rows coupled to no other: their B is E.
    """
    count = len(system)
    unseen = np.ones(count, dtype=bool)
    sets, alone = [], []
    for first in range(count):
        if not unseen[first]:
            continue
        reached = _reach(system, first, unseen)
        if len(reached) > 1:
            sets.append(reached)
        else:
            alone.append(first)
    return sets, np.array(alone, dtype=np.int64)


def _reach(system: LinearSystem, first: int, unseen: Array) -> Array:
    """Return the sorted rows joined to `first` by any path, and remove them from `unseen`."""
    unseen[first] = False
    frontier, reached = np.array([first]), [first]
    while len(frontier):
        near = np.zeros(len(system), dtype=bool)
        for start in range(0, len(frontier), CHUNK_ROWS):
            near |= _neighbors(system, frontier[start : start + CHUNK_ROWS])
        frontier = np.flatnonzero(near & unseen)
        unseen[frontier] = False
        reached.extend(frontier.tolist())
    return np.sort(np.array(reached))


def _neighbors(system: LinearSystem, rows: Array) -> Array:
    """Return (n,) whether an entry couples an unknown to any of `rows`, in either direction."""
    near = np.zeros(len(system), dtype=bool)
    for matrix in (system.exchange, system.mass):
        if matrix is None:
            continue
        near |= (matrix[rows] != 0).any(axis=0)
        if matrix is system.mass or not system.reciprocal:
            near |= (matrix[:, rows] != 0).any(axis=1)
    return near


def describe_sets(sets: list[Array], area: Array, unknown: Array, triangle: Array) -> list[dict[str, Any]]:
    """Describe independent sets for the report, the largest area first.

    sets list of (k,) int: From `independent_sets`.
    area (l,): Of each leaf element [m²].
    unknown (l,) int: An unknown of each leaf.
    triangle (l,) int: The scene triangle of each leaf.
    Returns described: "elements", "area_m2", and "triangles": the rows of the set's triangles, those with the
        largest parts in it first.
    """
    label = np.full(1 + max(int(rows.max(initial=0)) for rows in [unknown, *sets]), -1)
    for number, rows in enumerate(sets):
        label[rows] = number
    of_leaf = label[unknown]
    described = []
    for number in range(len(sets)):
        leaves = np.flatnonzero(of_leaf == number)
        rows, part = np.unique(triangle[leaves], return_inverse=True)
        order = np.argsort(-np.bincount(part.reshape(-1), area[leaves]), kind="stable")
        described.append(
            {
                "elements": len(leaves),
                "area_m2": float(area[leaves].sum()),
                "triangles": rows[order].tolist(),
            }
        )
    return sorted(described, key=lambda entry: -entry["area_m2"])
