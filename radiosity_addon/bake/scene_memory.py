"""What a scene that was read takes of the memory limit, counted before anything is made for it.

The peak is in the solver, or while texels are lit: these take what is left, and files beyond it
(`texel_memory.py`). What this process takes already, with the open file and the scene's arrays, is part of
the limit and of every figure that is shown.
"""

from __future__ import annotations

import math

from ..base import UsageError
from ..options import BakeSettings
from ..solver.state import least_bytes as solver_bytes
from .quality import quality_of
from .texel_memory import memory_limit, process_bytes

PREPARED_BYTES = 400.0
"""Of a triangle's UVs and charts, and of the tree that rays are traced in …"""

LASTING_BYTES = 410.0
"""… and of a face once it is solved (docs/decisions/0052)."""


def solving_bytes(triangles: int, faces: int, settings: BakeSettings) -> float:
    """Return what a scene takes at the peak of the solver, in addition to what this process takes [bytes]."""
    return triangles * PREPARED_BYTES + solver_bytes(faces, quality_of(settings).solver)


def waiting_bytes(triangles: int, faces: int) -> float:
    """Return what a solved scene takes while its texels are lit, in addition to that and to them [bytes]."""
    return triangles * PREPARED_BYTES + faces * LASTING_BYTES


def refuse_many_triangles(triangles: int, faces: int, settings: BakeSettings, textures: float = 0.0) -> None:
    """Refuse a scene whose bake will not fit into the memory limit, whatever its pages are.

    triangles: Of the whole scene.
    faces: Their sides that take part in the light.
    textures: What evaluating its materials will take [bytes].
    Raises UsageError: Names the number of triangles, what they need, and what helps.
    """
    if settings.method != "hierarchical":
        return
    limit = memory_limit(settings)
    needed, taken = textures + solving_bytes(triangles, faces, settings), process_bytes()
    # Small scenes fit next to whatever Blender has open, as ever.
    if needed <= max(limit - taken, 0.5 * limit):
        return
    raised = math.ceil(10 * (needed + taken) / 2**30) / 10
    raise UsageError(
        f"{triangles:,} triangles with {faces:,} lit sides need about {(needed + taken) / 2**30:.1f} GiB, "
        f"{taken / 2**30:.1f} of them taken now, but the memory limit is {limit / 2**30:g} GiB: "
        f"raise the limit to {raised:.1f}, or set objects to Ignore"
    )
