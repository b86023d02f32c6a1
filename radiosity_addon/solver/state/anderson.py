"""Anderson acceleration: the next guess from the last few steps of an iteration together.

Plain iteration B ← g(B) takes 1/(1 − ρ) gathers per digit. From the last m steps the mixture
is taken whose changes f = g(B) − B cancel best (Anderson 1965). For a linear g that does what
GMRES restarted after m steps does (Walker and Ni 2011), with one gather a step, no transpose
and no symmetric matrix; a g that is linear except for a clamp at 0 does no harm.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array

DEPTH = 5
"""Steps remembered: two arrays of radiosity each."""

GROWTH = 2.0
"""When the change exceeds this many times the smallest one, the history is discarded."""


class Anderson:
    """Proposes the next guess of a fixed-point iteration, each column for itself.

    weight (n,): How much each row's change counts: areas.
    depth: 0 is the plain iteration.
    """

    def __init__(self, weight: Array, depth: int = DEPTH) -> None:
        self._weight, self._depth = weight, depth
        self._least = np.inf
        self._last: tuple[Array, Array] | None = None
        self._changes: list[Array] = []
        self._images: list[Array] = []

    def next(self, guess: Array, image: Array) -> Array:
        """Return the (n, k) guess to try after `guess` gave `image`."""
        change = image - guess
        size = float(self._weight @ (change * change).sum(axis=1))
        if size > GROWTH**2 * self._least:
            self._forget()
        self._least = min(self._least, size)
        if self._last is not None and self._depth > 0:
            self._changes = [*self._changes, change - self._last[0]][-self._depth :]
            self._images = [*self._images, image - self._last[1]][-self._depth :]
        self._last = change, image
        if not self._changes:
            return image
        mixed = image.copy()
        for column in range(image.shape[1]):
            steps = np.stack([step[:, column] for step in self._changes])
            weighed = steps * self._weight
            share = _least_squares(weighed @ steps.T, weighed @ change[:, column])
            for part, step in zip(share, self._images, strict=True):
                mixed[:, column] -= part * step[:, column]
        return mixed

    def _forget(self) -> None:
        self._least, self._last, self._changes, self._images = np.inf, None, [], []


def _least_squares(normal: Array, right: Array) -> Array:
    """Solve the (m, m) normal equations, the steps scaled alike; steps that add nothing get no share."""
    scale = np.sqrt(np.diag(normal))
    scale = np.where(scale > 0, scale, 1.0)
    share = np.linalg.lstsq(normal / np.outer(scale, scale), right / scale, rcond=1e-12)[0]
    return np.asarray(share / scale)
