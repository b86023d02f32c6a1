"""What texels may take of the memory limit, and the least that they need.

What is looked up at random stays in memory: the page's texel numbers, the light that hits are looked up in,
the images themselves. Everything else is worked on in tiles and lives in files where memory is short
(`solver/scratch.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from .lightmap.texel_geometry import TexelGeometry
from .settings import BakeSettings
from .solver.parallel import thread_count
from .solver.scratch import Scratch
from .solver.settings import SolverSettings

PAGE_BYTES = 20.0
"""Of every pixel of a page, while it is rasterised and while pages are put together, …"""

TEXEL_BYTES = 28.0
"""… and of every texel that a triangle covers, while it is lit, with its number (docs/decisions/0046)."""

IMAGE_BYTES = 34.0
"""Of every pixel when the pages have become images: the page, what overlays show, the image itself, …"""

COPY_BYTES = 16.0
"""… and the copy through which Blender takes an image, one at a time."""

WORKING_BYTES, THREAD_BYTES = 120e6, 60e6
"""Temporaries of a tile, and of each thread."""


def memory_limit(settings: BakeSettings) -> float:
    """Return the memory limit of a bake [bytes]."""
    given = settings.memory_limit
    return (SolverSettings().memory_limit if given is None else given) * 2**30


def least_bytes(pages: Sequence[int]) -> float:
    """Return what the texels of pages of some sizes take at least, whatever lives in files [bytes]."""
    pixels = sum(size**2 for size in pages)
    lit = max(PAGE_BYTES, TEXEL_BYTES) * pixels
    return max(lit, IMAGE_BYTES * pixels + COPY_BYTES * max(pages, default=0) ** 2)


def working_bytes(settings: BakeSettings) -> float:
    """Return what temporaries take [bytes]."""
    return WORKING_BYTES + THREAD_BYTES * thread_count(settings.threads)


def texel_scratch(pages: Sequence[int], settings: BakeSettings) -> Scratch:
    """Return what makes the arrays of texels before the scene is solved, of which nobody knows the memory."""
    free = memory_limit(settings) - process_bytes() - working_bytes(settings)
    return Scratch(max(BEFORE_SOLVING * (free - least_bytes(pages)), 0.0))


def share_out_memory(geometry: TexelGeometry, settings: BakeSettings) -> None:
    """Give the texels' arrays what the scene, the solution and the floor leave of the memory limit."""
    scratch = geometry.scratch
    floor = TEXEL_BYTES * len(geometry) + working_bytes(settings)
    free = memory_limit(settings) - process_bytes() - floor
    scratch.budget = max(scratch.in_memory + free, 0.0)


BEFORE_SOLVING = 0.25
"""Share of the free memory that the places of texels may take."""

PROCESS_BYTES = 600e6
"""What Blender and a scene take where the system does not tell."""


def process_bytes() -> float:
    """Return the memory that this process takes now [bytes]."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return PROCESS_BYTES
    return 4096.0 * pages
