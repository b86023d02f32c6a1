"""The world's constant colour as an environment light."""

from __future__ import annotations

import bpy
import numpy as np

from ..bake_scene import BakeWarning
from ..solver.lights import EnvironmentLight
from .materials import read_radiance, uses_nodes


def read_world(world: bpy.types.World | None) -> tuple[EnvironmentLight | None, tuple[BakeWarning, ...]]:
    """Return the light of a world, None where it is black or there is none.

    An environment texture counts with its mean over the sphere, and a warning says so.
    """
    if world is None:
        return None, ()
    if uses_nodes(world):
        radiance, warnings = read_radiance(world, "world")
    else:
        radiance, warnings = np.array(world.color[:3], dtype=np.float64), ()
    return (EnvironmentLight(radiance, name=world.name) if radiance.any() else None), warnings
