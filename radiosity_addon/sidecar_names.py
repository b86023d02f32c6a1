"""What a sidecar is called, and what a report says of it: light to import, for panels."""

from __future__ import annotations

SIDECAR_NAME = "lightmap.relight"

KEPT = "kept"
"""A report's key, of a bake that was kept in a sidecar; one without it is of a bake that was not. Under it
stand …"""

BAKE = "bake"
"""… the mark of the bake, …"""

DIGEST = "digest"
"""… the digest in the sidecar's head, …"""

FILE = "file"
"""… and its name."""
