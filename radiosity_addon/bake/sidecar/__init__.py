"""A kept bake in a file next to its lightmaps, and checks of what is read of bakes.

Reading it runs nothing, and checks everything.
"""

from __future__ import annotations

from .bake_checks import check_bake_scene, check_result
from .sidecar import StoredBake, check_belongs, read_sidecar, sidecar_entry, write_sidecar
from .sidecar_checks import check_settings

__all__ = [
    "StoredBake",
    "check_bake_scene",
    "check_belongs",
    "check_result",
    "check_settings",
    "read_sidecar",
    "sidecar_entry",
    "write_sidecar",
]
