"""A solved scene whose triangles have moved, by the elements that it was solved with.

What rays met is numbered by these elements, so they move with their faces. Their light is not solved
again: texels bring what has changed (`lightmap/lighting/reconstruction.py`), and the hierarchy is where they
start.
"""

from __future__ import annotations

from copy import copy

import numpy as np

from ..numerics import Array, split_in_four
from ..scene import Faces, Scene, ray_caster
from .element_transport import Relightable
from .emitters import LightSources
from .gather import LocalPass
from .hierarchy import LEAF, Hierarchy
from .methods import HierarchicalState


def on_scene(hierarchy: Hierarchy, scene: Scene) -> Hierarchy:
    """Return the same elements over the faces of a scene whose triangles have moved.

    Its clusters stay what they were: links join them, and of links there are no new ones.

    Raises
    ------
    ValueError
        If the scene does not have the same faces.
    """
    moved = copy(hierarchy)
    moved.faces = Faces(scene, hierarchy.faces.left_out)
    if not np.array_equal(moved.faces.triangle, hierarchy.faces.triangle):
        raise ValueError("the scenes have different faces")
    count = len(moved.faces)
    moved.corners, moved.area = hierarchy.corners.copy(), hierarchy.area.copy()
    moved.corners[:count], moved.area[:count] = moved.faces.corners, moved.faces.area
    level = np.arange(count)
    while True:
        level = level[moved.first_child[level] != LEAF]
        if len(level) == 0:
            return moved
        children = moved.first_child[level][:, None] + np.arange(4)
        moved.corners[children] = split_in_four(moved.corners[level])
        moved.area[children] = moved.area[level][:, None] / 4.0
        level = children.ravel()


def carried(solved: Relightable, scene: Scene, emitter: Array | None = None) -> Relightable:
    """Return what relights a scene after triangles of it have moved, its elements' light as it was.

    Parameters
    ----------
    scene : Scene
        As it is now.
    emitter : (t,) int or None
        See `LightSources`.
    """
    local = solved.local
    elements = on_scene(local.elements.hierarchy, scene)
    caster = ray_caster(scene, local.threads)
    sources = LightSources(scene, elements.faces, caster, emitter)
    before = local.elements.state
    # Without links: those that `elements` solves by are the hierarchy's own.
    state = HierarchicalState(
        scene,
        before.settings,
        elements,
        caster,
        before.power,
        irradiance=before.irradiance,
        radiosity=before.radiosity,
    )
    return Relightable(sources, solved.elements, LocalPass.of(state, sources, local.direct.part))
