"""Numbers and names that several rooms share and nobody chooses."""

from __future__ import annotations

EFFICACY = 683.0
"""Lumens a watt of green light of 555 nm; taken for all light where nothing else is said [lm/W]."""

TEXEL_STEPS = 256
"""Of a texel, that corners are on where each object has a rectangle: float32 UVs give them back exactly."""

MAX_PAGES = 64
"""That objects can share."""

MAX_RESOLUTION = 16384
"""Width and height of the largest page."""

MAX_GROUPS = 24
"""Light groups of a bake: each is an image that its materials read, and graphics cards take 32, some 16."""

OTHERS = "others"
"""The light group of what is in none."""
