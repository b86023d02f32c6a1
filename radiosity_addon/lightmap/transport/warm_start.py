"""Light that was solved before, to start from: it is linear in the strengths of its sources.

Who drags the slider of a lamp asks for light that is a mixture of the last two answers. A mixture of
solutions is a solution, so the sweeps that follow find that nothing changes.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array

MAX_SOLUTIONS = 6
"""Solutions remembered: 12 bytes a texel each."""

MIXED = 1e-6
"""Strengths are a mixture of earlier ones if all but this part of them is."""


class WarmStart:
    """Remembers the strengths of light's sources, and what surfaces reflected then.

    Parameters
    ----------
    strengths : (s, 3) float64
    table : (r, 3) float32 [W/m²]
        The first solution, which is never forgotten.

    Attributes
    ----------
    solutions : list of (strengths, table)
    """

    STORED = ("solutions",)

    def __init__(self, strengths: Array, table: Array) -> None:
        self.solutions = [(strengths.copy(), table)]

    @property
    def baked(self) -> Array:
        """(r, 3) float32: the first solution, of the strengths that were baked [W/m²]."""
        return self.solutions[0][1]

    def add(self, strengths: Array, table: Array) -> None:
        """Remember another solution, for the oldest if there are many."""
        first, *others = self.solutions
        self.solutions = [first, *others[-(MAX_SOLUTIONS - 2) :], (strengths.copy(), table)]

    def first(self) -> WarmStart:
        """Return what remembers the first solution alone."""
        return WarmStart(*self.solutions[0])

    def mixed(self, strengths: Array) -> Array | None:
        """Return (r, 3) what surfaces reflect at (s, 3) strengths; None if they are no such mixture."""
        result = np.zeros_like(self.solutions[0][1])
        for channel in range(3):
            basis = np.stack([known[:, channel] for known, _ in self.solutions], axis=1)
            wanted = strengths[:, channel]
            # Sources have different units, and a dim one counts as well.
            scale = np.maximum(np.abs(basis).max(axis=1), wanted)
            scale = np.where(scale > 0, scale, 1.0)
            share = np.linalg.lstsq(basis / scale[:, None], wanted / scale, rcond=1e-9)[0]
            if np.abs((basis @ share - wanted) / scale).max(initial=0.0) > MIXED:
                return None
            for part, (_, table) in zip(share, self.solutions, strict=True):
                result[:, channel] += np.float32(part) * table[:, channel]
        return np.maximum(result, 0.0)

    def part_of(self, strengths: Array) -> tuple[Array, Array]:
        """Return what of some strengths is known, as much as can be taken off without going below 0.

        Returns
        -------
        table : (r, 3) float32 [W/m²]
            What surfaces reflect of it.
        left : (s, 3) float64
            The strengths that are left.
        """
        left, table = strengths.copy(), np.zeros_like(self.solutions[0][1])
        for known, of_known in reversed(self.solutions):
            there = known > 0
            ratio = np.where(there, left / np.where(there, known, 1.0), np.inf).min(axis=0)
            share = np.where(there.any(axis=0), ratio, 0.0)
            left = np.maximum(left - share * known, 0.0)
            table += share.astype(np.float32) * of_known
        return table, left
