"""How finely texels gather."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class GatherSettings:
    """How densely indirect light is gathered.

    strides: Lattices of gather points, coarse to fine, in texels; finer ones are used only where coarser
        points do not reach. The last is 1, so that every texel is reached.
    support: A texel whose coarser points weigh less than this together becomes a point itself.
    rays: A gather point where every texel is one; on coarser lattices `times_rays` as many.
    cell_rays: Most rays of a cell that gather rays met where no texel answers.
    sweeps: Jacobi sweeps over the texels, at most, …
    tolerance: … or until no texel changes by more than this part of the mean.
    """

    strides: tuple[int, ...] = (4, 2, 1)
    support: float = 1.0
    rays: int = 256
    sweeps: int = 64
    tolerance: float = 2e-4
    cell_rays: int = 64

    @property
    def times_rays(self) -> tuple[float, ...]:
        """Times as many rays of a lattice's points: the square root of the texels that one speaks for."""
        points_a_texel = max(self.support, 1.0)
        return tuple(max(stride / math.sqrt(points_a_texel), 1.0) for stride in self.strides)
