"""How large the steps across seams are, against those between neighbors inside charts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from radiosity_addon.lightmap.images.seams import Seams
from radiosity_addon.lightmap.texels import NO_TEXEL, TexelGeometry
from radiosity_addon.numerics import Array

NEIGHBOR = 2.5
"""Texels side by side on the page are neighbors if they lie no farther apart [texels] in the world."""


@dataclass(frozen=True)
class SeamSteps:
    """Relative steps |a − b| / ½(a + b), of the sums over the channels.

    across (s,): At places on seams, between bilinear look-ups on either side.
    inside (p,): Between texels side by side in one chart, everywhere.
    near_seams (q,): The same, for texels that a look-up on a seam reads.
    """

    across: Array
    inside: Array
    near_seams: Array

    def medians(self) -> tuple[float, float, float]:
        """Return the medians of the three; 0 for none."""
        across, inside, near_seams = (
            float(np.median(steps)) if len(steps) else 0.0
            for steps in (self.across, self.inside, self.near_seams)
        )
        return across, inside, near_seams


def seam_steps(geometry: TexelGeometry, seams: Seams, pages: Sequence[Array]) -> SeamSteps:
    """Measure the steps on baked pages, (height, width, 3) each."""
    values = np.concatenate([page.reshape(-1, page.shape[-1]) for page in pages]).sum(
        axis=1, dtype=np.float64
    )
    sides = seams.sides(values[:, None])[..., 0]
    pair = np.concatenate([_neighbors(numbers) for numbers in geometry.index])
    apart = np.linalg.norm(geometry.position[pair[:, 0]] - geometry.position[pair[:, 1]], axis=1)
    pair = pair[apart < NEIGHBOR * geometry.texel_size]
    of_texel = np.empty(len(geometry))
    read = np.zeros(len(values), dtype=bool)
    read[seams.texel[seams.weight > 0]] = True
    near = np.empty(len(geometry), dtype=bool)
    first = 0
    for numbers in geometry.index:
        inside = numbers != NO_TEXEL
        there = slice(first, first + numbers.size)
        of_texel[numbers[inside]] = values[there].reshape(numbers.shape)[inside]
        near[numbers[inside]] = read[there].reshape(numbers.shape)[inside]
        first += numbers.size
    steps = _relative(of_texel[pair])
    return SeamSteps(_relative(sides), steps, steps[near[pair].any(axis=1)])


def _neighbors(numbers: Array) -> Array:
    """Return (p, 2): covered texels side by side, along rows and along columns."""
    pairs = np.concatenate(
        [
            np.stack([numbers[:, :-1], numbers[:, 1:]], axis=2).reshape(-1, 2),
            np.stack([numbers[:-1], numbers[1:]], axis=2).reshape(-1, 2),
        ]
    )
    return np.asarray(pairs[(pairs != NO_TEXEL).all(axis=1)])


def _relative(pairs: Array) -> Array:
    """Return (n,) |a − b| / ½(a + b) of (n, 2) values; 0 where both are 0."""
    mean = 0.5 * np.abs(pairs).sum(axis=1)
    return np.asarray(np.abs(pairs[:, 0] - pairs[:, 1]) / np.where(mean > 0, mean, 1.0))
