"""States of texels: normal, divided, occluded, touched, enclosed."""

from __future__ import annotations

NO_TEXEL_HERE = 255
"""The state of a pixel that shows no surface: it was filled from its neighbors."""


DIVIDED, OCCLUDED, TOUCHED, ENCLOSED = 1, 2, 3, 4

TEXEL_STATES = (0, DIVIDED, OCCLUDED, TOUCHED, ENCLOSED)
"""0: normal. Geometry stands on the texel or a close rim is above it; something is close above
all of it; it ends at geometry; no light reaches it because it is inside or behind something."""
