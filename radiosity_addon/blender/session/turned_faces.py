"""Faces that a bake or Check found to show their backs, by their numbers in the meshes as they were."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple


class TurnedFaces(NamedTuple):
    """Of one object.

    object: Its name.
    runs: First and last polygon of each run.
    is_whole: All of its polygons.
    is_made: Modifiers make its polygons, so that the mesh has others.
    is_right_elsewhere: An instance of the object shows other polygons, or none, from behind.
    shape: Digest of its own mesh and of how it is turned: polygons count only while both are as they were.
    """

    object: str
    runs: tuple[tuple[int, int], ...]
    is_whole: bool
    is_made: bool
    is_right_elsewhere: bool
    shape: str

    @property
    def polygons(self) -> list[int]:
        """The numbers of the polygons, in ascending order."""
        return [number for first, last in self.runs for number in range(first, last + 1)]


def runs_of(polygons: Iterable[int]) -> tuple[tuple[int, int], ...]:
    """Return first and last of each run of numbers that are given in ascending order."""
    runs: list[tuple[int, int]] = []
    for number in polygons:
        if runs and number == runs[-1][1] + 1:
            runs[-1] = runs[-1][0], number
        else:
            runs.append((number, number))
    return tuple(runs)


def to_json(found: Iterable[TurnedFaces]) -> list[list[Any]]:
    """Return what JSON can hold of them."""
    return [list(faces) for faces in found]


def from_json(stored: Iterable[Any]) -> tuple[TurnedFaces, ...]:
    """Return what `to_json` wrote.

    Raises ValueError, TypeError for what somebody else did.
    """
    found = []
    for name, runs, is_whole, is_made, is_right_elsewhere, shape in stored:
        numbers = tuple((int(first), int(last)) for first, last in runs)
        found.append(
            TurnedFaces(
                str(name), numbers, bool(is_whole), bool(is_made), bool(is_right_elsewhere), str(shape)
            )
        )
    return tuple(found)
