"""A solved scene seen through the elements of another hierarchy over the same faces.

What rays met is numbered by the elements that there were when they were traced. When something moves, these
elements move with their faces, and take what a new solution, with elements of its own, says of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .arrays import Array
from .element_transport import ElementTransport, Relightable
from .hierarchy import LEAF, Hierarchy
from .light_sources import LightSources
from .local_pass import LocalPass
from .scene import Scene
from .state import SolverState


def on_scene(hierarchy: Hierarchy, scene: Scene) -> Hierarchy:
    """Return the same elements over the faces of a scene whose triangles have moved.

    Raises
    ------
    ValueError
        If it does not have the same faces.
    """
    moved = Hierarchy(scene)
    if len(moved.faces) != len(hierarchy.faces):
        raise ValueError("the scenes have different faces")
    parents = np.flatnonzero(hierarchy.first_child != LEAF)
    parents = parents[np.argsort(hierarchy.first_child[parents])]
    while len(parents):
        # As many at once as there are already, so that the children get the same numbers.
        missing = np.flatnonzero(parents >= moved.n_elements)
        ready = int(missing[0]) if len(missing) else len(parents)
        moved.subdivide(parents[:ready])
        parents = parents[ready:]
    return moved


def covering(hierarchy: Hierarchy, elements: Hierarchy) -> Array:
    """Return (e,) int32: what of a hierarchy covers each element of another one over the same faces.

    The same element, where it was split as far, else the leaf that holds it.
    """
    found = np.empty(elements.n_elements, dtype=np.int32)
    count = len(elements.faces)
    found[:count] = np.arange(count)
    level = np.arange(count)
    while True:
        level = level[elements.first_child[level] != LEAF]
        if len(level) == 0:
            return found
        children = elements.first_child[level][:, None] + np.arange(4)
        above = found[level]
        inner = hierarchy.first_child[above] != LEAF
        below = np.where(inner[:, None], hierarchy.first_child[above][:, None] + np.arange(4), above[:, None])
        found[children] = below
        level = children.ravel()


class CarriedTransport(ElementTransport):
    """The links of one hierarchy, asked for the light of another one's elements.

    Parameters
    ----------
    state, sources : as for `ElementTransport`
    of : (e,) int
        The element of the solved hierarchy that covers each of the other's.
    """

    def __init__(self, state: SolverState, sources: LightSources, of: Array) -> None:
        super().__init__(state, sources)
        self._of = of

    def irradiance(self, strengths: Array) -> Array:
        """Solve for (s, 3) strengths of the sources: (e, 3) over the other's elements [W/m²]."""
        return np.asarray(super().irradiance(strengths)[self._of])


def carried(state: SolverState, elements: Hierarchy, emitter: Array | None = None) -> Relightable:
    """Return what lights a solved scene anew, by the elements of another hierarchy over its faces.

    Parameters
    ----------
    emitter : (t,) int or None
        See `LightSources`.

    Raises
    ------
    UsageError
        If the method keeps no links.
    """
    sources = LightSources(state.scene, state.hierarchy.faces, state.caster, emitter)
    of = covering(state.hierarchy, elements)
    seen = replace(state, hierarchy=elements, irradiance=state.irradiance[of], radiosity=state.radiosity[of])
    return Relightable(sources, CarriedTransport(state, sources, of), LocalPass(seen, sources))
