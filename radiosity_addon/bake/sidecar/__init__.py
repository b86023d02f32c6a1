"""A kept bake in a file next to its lightmaps.

Reading it runs nothing, and checks everything.
"""

from __future__ import annotations

from .sidecar import StoredBake, check_belongs, read_sidecar, sidecar_entry, write_sidecar

__all__ = [
    "StoredBake",
    "check_belongs",
    "read_sidecar",
    "sidecar_entry",
    "write_sidecar",
]
