"""What the hierarchical method may allocate: `memory_limit`, shared out among its stages.

Faces are always needed, so a scene whose faces and coarsest links do not fit is refused before
anything is allocated. The rest is for elements that lamps need, then for links and the elements
that these split.
"""

from __future__ import annotations

import numpy as np

from ...base import UsageError
from ...numerics import thread_count
from ...scene import Scene
from ..hierarchy import Hierarchy
from ..links import LINK_SLACK, MIN_LINKS
from ..settings import SolverSettings

LINK_BYTES = 200
"""Memory a link takes while links are sorted and gathered over (52 bytes at rest, 48 to a cluster), …"""

LIGHT_LINK_BYTES = 80
"""… that a link from a lamp takes, …"""

FACE_BYTES = 900
"""… that a face takes with its element and its cluster while light is gathered (docs/decisions/0052), …"""

ELEMENT_BYTES = 500
"""… that an element below a face takes while light is gathered, …"""

WORKING_BYTES, THREAD_BYTES = 60 << 20, 100 << 20
"""… and that is needed to look at pairs, and by each thread that measures them (see docs/solver.md)."""

LIGHT_ELEMENTS = 0.25
"""Elements that lamps ask for may take this part of what faces leave."""


LEAST_ROOM = 0.01
"""Room for so small a share of the links is left: to fill it bit by bit would take many gathers."""


def refuse_beyond(limit: float, needed: float, what: str, advice: str) -> None:
    """Refuse what needs more bytes than the memory limit [GiB] allows.

    Raises UsageError: Says what it is, what it needs, the limit, and what helps.
    """
    if needed > limit * 2**30:
        raise UsageError(
            f"{what} needs at least {needed / 2**30:.3g} GiB, more than the memory limit of {limit:g} GiB: "
            f"{advice}"
        )


def refuse_large_scene(scene: Scene, settings: SolverSettings) -> None:
    """Refuse a scene whose faces and coarsest first links do not fit into the memory limit.

    Raises UsageError: Names the number of faces, what they need, and what helps.
    """
    faces = lit_sides(scene)
    what = f"the hierarchical method with {faces:,} faces"
    advice = "raise the limit, or leave objects out of the scene"
    refuse_beyond(settings.memory_limit, least_bytes(faces, settings), what, advice)


def lit_sides(scene: Scene) -> int:
    """Return the number of faces that a scene will have (`Faces`)."""
    solid = (scene.areas > 0) & scene.in_bounces
    return int(solid.sum() + (solid & scene.two_sided & ~scene.sealed).sum())


def least_bytes(faces: int, settings: SolverSettings) -> float:
    """Return what faces, their coarsest first links and measuring need [bytes]."""
    pairs = float(faces) ** 2
    links = min(LINK_SLACK * MIN_LINKS, pairs)
    threads = thread_count(settings.threads)
    # A thread measures a chunk of pairs at most; small scenes have no more.
    working = (WORKING_BYTES + threads * THREAD_BYTES) * min(1.0, pairs / MIN_LINKS)
    return faces * FACE_BYTES + links * LINK_BYTES + working


def free_bytes(hierarchy: Hierarchy, settings: SolverSettings, light_links: int = 0) -> float:
    """Return what faces, elements, links from lamps and measuring leave of the memory limit."""
    faces = len(hierarchy.faces)
    threads = thread_count(settings.threads)
    taken = FACE_BYTES * faces + ELEMENT_BYTES * (hierarchy.n_elements - faces)
    taken += LIGHT_LINK_BYTES * light_links
    working = (WORKING_BYTES + threads * THREAD_BYTES) * min(1.0, float(faces) ** 2 / MIN_LINKS)
    return max(settings.memory_limit * 2**30 - taken - working, 0.0)


def most_light_elements(hierarchy: Hierarchy, settings: SolverSettings) -> int:
    """Return how many elements there may be once lamps and the sky are linked."""
    room = LIGHT_ELEMENTS * free_bytes(hierarchy, settings) / ELEMENT_BYTES
    return hierarchy.n_elements + int(min(room, np.iinfo(np.int32).max / 2))


def link_budget(hierarchy: Hierarchy, settings: SolverSettings, light_links: int) -> int:
    """Return how many links there may be: `max_links`, or what all else leaves of the memory."""
    return min(settings.max_links, int(free_bytes(hierarchy, settings, light_links) / LINK_BYTES))


def refinable(hierarchy: Hierarchy, settings: SolverSettings, links: int, light_links: int) -> int:
    """Return how many of `count` links may be refined at once: three more links each, and four elements."""
    free = free_bytes(hierarchy, settings, light_links) - LINK_BYTES * links
    in_memory = int(max(free, 0.0) / (3 * LINK_BYTES + 4 * ELEMENT_BYTES))
    room = min(max((settings.max_links - links - light_links) // 3, 0), in_memory)
    return room if room > LEAST_ROOM * links else 0
