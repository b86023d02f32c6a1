"""What a report says of the sidecar that a bake was kept in: light to import, for panels."""

from __future__ import annotations

KEPT = "kept"
"""A report's key, of a bake that was kept in a sidecar; one without it is of a bake that was not. Under it
stand …"""

BAKE = "bake"
"""… the mark of the bake, …"""

DIGEST = "digest"
"""… the digest in the sidecar's head, …"""

FILE = "file"
"""… and its name."""
