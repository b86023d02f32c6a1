"""What texels may take of the memory limit, and the least that they need.

What is looked up at random stays in memory: the numbers of the pages' texels, the light that hits are
looked up in, the images that Blender holds. Everything else is worked on in tiles and lives in files where
memory is short (`numerics/scratch.py`). So only very large pages are refused (docs/decisions/0046).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from ..base import UsageError
from ..lightmap.texels import TexelGeometry
from ..numerics import Scratch, thread_count
from ..options import BakeSettings
from ..solver.settings import SolverSettings

LIT_BYTES = 48.0
"""Of every texel while it is lit: its number, its light, what geometry does to it, which rays it needs."""

ELEMENT_BYTES = 480.0
"""Of every element while texels are lit: what is known of each of its cells, and the light of those that rays
meet. In foliage an element has forty cells, and rays meet twelve of them."""

IMAGE_BYTES, COPY_BYTES = 16.0, 16.0
"""Of every pixel of an image in Blender, and of the copy that it is made from, one image at a time."""

WORKING_BYTES, THREAD_BYTES = 120e6, 80e6
"""Temporaries of a tile, and of each thread, of pages of at least …"""

WORKING_PIXELS = 1 << 20
"""… this many pixels; of smaller ones in proportion."""

BEFORE_SOLVING = 0.25
"""Share of the free memory that the places of texels may take before the scene is solved."""

SHOWN_BYTES, SHOWN_SHARE = 200.0, 0.3
"""Of every texel if they are shown while they are lit, which they are if that takes no more than this share
of what is free then."""

PROCESS_BYTES = 600e6
"""What Blender and a scene take if the system does not report it."""


def memory_limit(settings: BakeSettings) -> float:
    """Return the memory limit of a bake [bytes]."""
    given = settings.memory_limit
    return (SolverSettings().memory_limit if given is None else given) * 2**30


def room(settings: BakeSettings) -> float:
    """Return what Blender and the scene leave of the memory limit, half of it at least [bytes]."""
    limit = memory_limit(settings)
    return max(limit - process_bytes(), 0.5 * limit)


def least_bytes(pages: Sequence[int], settings: BakeSettings) -> float:
    """Return the least that pages of these sizes take outside temporary files [bytes]."""
    pixels = float(sum(size**2 for size in pages))
    # Besides the image there are its copy for Cycles, and those of light groups.
    images = IMAGE_BYTES * (2 + len(settings.groups)) * pixels
    most = max(LIT_BYTES * pixels, images + COPY_BYTES * max(pages, default=0) ** 2)
    return most + working_bytes(settings) * min(pixels / WORKING_PIXELS, 1.0)


def refuse_large_pages(pages: Sequence[int], settings: BakeSettings) -> None:
    """Refuse pages that do not fit into the memory limit, even in tiles.

    pages: The width and height of each in texels.
    Raises UsageError: Names the pages, what they need, and what helps.
    """
    needed, left = least_bytes(pages, settings), room(settings)
    if needed <= left:
        return
    largest = max(pages)
    what = f"a page of {largest}²" if len(pages) == 1 else f"{len(pages)} pages of up to {largest}²"
    smaller = "texel density" if settings.texel_density is not None else "resolution"
    limit = memory_limit(settings) / 2**30
    # Rounded up: the limit that is named has to do.
    raised = math.ceil(10 * (needed + memory_limit(settings) - left) / 2**30) / 10
    raise UsageError(
        f"at least {needed / 2**30:.1f} GiB of memory needed for {what} pixels, but the memory limit of "
        f"{limit:g} GiB leaves {left / 2**30:.1f}: lower the {smaller}, or raise the limit to {raised:.1f}"
    )


def pages_of(settings: BakeSettings) -> tuple[int, ...] | None:
    """Return the sizes of the pages where the settings alone determine them, else None."""
    if settings.texel_density is not None or settings.atlas != "shared":
        return None
    return (settings.resolution,) * settings.pages


def working_bytes(settings: BakeSettings) -> float:
    """Return what temporaries take [bytes]."""
    return WORKING_BYTES + THREAD_BYTES * thread_count(settings.threads)


def texel_scratch(pages: Sequence[int], settings: BakeSettings) -> Scratch:
    """Return what makes the arrays of texels before the scene is solved, which takes who knows how much."""
    free = memory_limit(settings) - process_bytes() - least_bytes(pages, settings)
    return Scratch(max(BEFORE_SOLVING * free, 0.0))


def share_out_memory(geometry: TexelGeometry, settings: BakeSettings, keep: bool, elements: int) -> bool:
    """Give the texels' arrays what the scene, the solution and the least leave of the memory limit.

    keep: Its arrays are still there when the images are made.
    elements: Of the solution, of all levels.

    Returns shown: Whether what is left suffices to show the texels while they are lit.
    """
    scratch, pages = geometry.scratch, [len(numbers) for numbers in geometry.index]
    floor = LIT_BYTES * len(geometry) + ELEMENT_BYTES * elements + working_bytes(settings)
    if keep:
        floor = max(floor, least_bytes(pages, settings))
    most, showing = memory_limit(settings) - floor, SHOWN_BYTES * len(geometry)
    shown = showing <= SHOWN_SHARE * (most - process_bytes())
    most -= showing if shown else 0.0
    scratch.budget = max(scratch.in_memory + most - process_bytes(), 0.0)
    scratch.free = lambda: most - process_bytes()
    return shown


def process_bytes() -> float:
    """Return the memory that this process takes now [bytes]."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return PROCESS_BYTES
    return 4096.0 * pages
