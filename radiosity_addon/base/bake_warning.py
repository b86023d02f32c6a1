"""A warning or note of a bake: which object it is about, and what was used instead."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BakeWarning:
    """Something that was not understood: whose it is, and what was used instead.

    is_note: Nothing is wrong: it says what the bake took something for.
    turned: Polygons of the object that show their backs, in ascending order; flipping them helps.
    """

    name: str
    message: str
    is_note: bool = False
    turned: tuple[int, ...] = ()
