"""The data of a scene that the search for covered surfaces needs."""

from __future__ import annotations

from typing import Protocol

from ..numerics import Array
from .textures import SurfaceImages


class Surfaces(Protocol):
    """The t triangles of a `Scene`, as far as their places and looks go; see there for shapes."""

    triangles: Array
    areas: Array
    face_normals: Array
    emission: Array
    two_sided: Array
    in_bounces: Array
    images: SurfaceImages | None

    def __len__(self) -> int: ...
