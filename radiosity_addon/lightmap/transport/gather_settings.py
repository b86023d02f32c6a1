"""How finely texels gather."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class GatherSettings:
    """How densely indirect light is gathered.

    strides: Lattices of gather points, coarse to fine, in texels; finer ones are used only where coarser
        points do not reach. The last is 1, so that every texel is reached.
    support: A texel whose coarser points weigh less than this together becomes a point itself.
    rays: A gather point where every texel is one; on coarser lattices times their stride.
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
