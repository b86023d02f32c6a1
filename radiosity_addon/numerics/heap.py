"""Memory that was freed, given back to the system."""

from __future__ import annotations

import ctypes


def give_back() -> None:
    """Give freed memory back to the system, where its allocator keeps it.

    glibc keeps what lay below something that is still used: after the export of 1.4 million triangles 0.7 GB,
    on top of which the solver's arrays would come.
    """
    try:
        trim = ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):
        return  # another system's, which gives it back by itself
    trim(0)
