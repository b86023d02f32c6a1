"""Edits of lightmap materials, carried to the materials that they are copies of."""

from __future__ import annotations

from ..bake_scene import BakeWarning


def carry_edits() -> tuple[BakeWarning, ...]:
    """Make every original equal to what the user made of its lightmap copy; returns what to warn of."""
    return ()
