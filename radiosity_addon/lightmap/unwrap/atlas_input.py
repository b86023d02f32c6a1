"""What is laid out on pages, and how."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .packing import Limits

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]


@dataclass(frozen=True)
class AtlasInput:
    """One object to lay out.

    Parameters
    ----------
    name : str
    triangles : (n, 3, 3) float
        Corners in world space [m].
    polygon : (n,) int
        The polygon of each triangle: it stays in one chart.
    uv : (n, 3, 2) float32 or None
        UVs to keep; None to unwrap.
    scale : float
        Its texels per meter, relative to the other objects.
    kind : (n,) int or None
        Only triangles of one kind share texels; None if all are alike.
    page : int
        The shared page that it is to be on, from 1; 0 for any.
    """

    name: str
    triangles: Float
    polygon: NDArray[np.int32]
    uv: Float32 | None = None
    scale: float = 1.0
    kind: NDArray[np.int64] | None = None
    page: int = 0


@dataclass(frozen=True)
class AtlasOptions:
    """How objects are laid out.

    Parameters
    ----------
    resolution : int
        Width and height of a page, if no density is given.
    texel_density : float or None
        Texels per meter; pages become as large as that needs, multiples of 4.
    shared : bool
        All objects on common pages, or each on its own.
    pages : int
        How many pages the objects share, if no density is given; with one, as many as it takes.
    limits : Limits
        Of every page.
    unwrap_seconds : float
        After so long an object's rest is cut into charts by the directions its faces look.
    rectangles : bool
        Each object has a rectangle of its own, and instances of a shape have the same layout in theirs.
    threads : int
        Pieces of large objects that are cut at once; 0 means all cores.
    """

    resolution: int = 512
    texel_density: float | None = None
    shared: bool = True
    pages: int = 1
    limits: Limits = field(default_factory=Limits)
    unwrap_seconds: float = 60.0
    threads: int = 0
    rectangles: bool = False
