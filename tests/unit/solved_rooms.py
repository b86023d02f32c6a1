"""Small scenes with their links made, for tests of what moves light over them."""

from __future__ import annotations

import numpy as np

from radiosity_addon.solver import Scene, SolverSettings
from radiosity_addon.solver.methods.hierarchical import HierarchicalState, solve
from tests.rooms import CEILING, WALLS, box_room, gray, gray_scene, solid_box


def furnished(reflectance: float = 0.6) -> Scene:
    """A closed room with a box in the air, its ceiling shining."""
    room, surface = box_room((3, 2, 2))
    triangles = np.concatenate([room, solid_box((0.5, 0.5, 0.3), (1.2, 1.2, 1.0))])
    emission = gray(len(triangles), 0.0)
    emission[:12][surface == CEILING] = (1.0, 0.5, 0.25)
    return gray_scene(triangles, reflectance, emission)


def corridor() -> Scene:
    """A long closed room of many triangles, one end shining: far groups are linked as clusters."""
    triangles, surface = box_room((6, 1, 1), n=3)
    emission = gray(len(triangles), 0.0)
    emission[surface == WALLS] = 1.0
    return gray_scene(triangles, 0.5, emission)


def solved(scene: Scene, **settings: float) -> HierarchicalState:
    """Run the solver and return all it worked on."""
    return solve(scene, SolverSettings(**settings))
