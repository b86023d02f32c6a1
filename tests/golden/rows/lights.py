"""Lamps: their shapes, their softness, their colours, and who they light."""

from __future__ import annotations

from . import row
from .stage import add_lamp, stage


@row("point-hard")
def point_hard() -> None:
    """Point lamp of radius 0."""
    stage()
    add_lamp("POINT", energy=100, shadow_soft_size=0.0)


@row("point-soft")
def point_soft() -> None:
    """Point lamp of radius 0.2."""
    stage()
    add_lamp("POINT", energy=100, shadow_soft_size=0.2)
