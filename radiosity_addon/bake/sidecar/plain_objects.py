"""Objects of known classes as plain values and arrays, and back: what a file can hold.

Only attributes that a table names are stored, and only classes in it are made again, without calling
anything of theirs: what was read cannot run. Objects that others share stay shared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

Table = Mapping[type, Sequence[str]]
"""Classes, and which of their attributes are kept; the others come back as None."""


def flatten(value: Any, table: Table, skipped: Sequence[tuple[Any, str]] = ()) -> tuple[Any, list[Array]]:
    """Return what JSON can hold of a value, and the arrays it refers to.

    Parameters
    ----------
    skipped : sequence of (object, attribute)
        What is stored as None although the table names it.

    Raises
    ------
    TypeError
        If it holds something that is in no table.
    """
    writer = _Writer(table, {(id(owner), name) for owner, name in skipped})
    tree = writer.node(value)
    return {"tree": tree, "objects": writer.objects}, writer.arrays


def restore(told: Any, arrays: list[Array], table: Table, dropped: Mapping[type, Sequence[str]]) -> Any:
    """Return the value that `flatten` took apart.

    Parameters
    ----------
    dropped : mapping of type to attributes
        What was not kept and is set to None.

    Raises
    ------
    ValueError, KeyError, TypeError, IndexError
        If it is not as `flatten` would write it.
    """
    reader = _Reader(arrays, {kind.__name__: kind for kind in table}, told["objects"])
    for made, entry in zip(reader.made, told["objects"], strict=True):
        kept, left = table[type(made)], dropped.get(type(made), ())
        if set(entry["has"]) != set(kept):
            raise ValueError("other attributes than these")
        for name in left:
            object.__setattr__(made, name, None)
        for name, node in entry["has"].items():
            object.__setattr__(made, name, reader.value(node))
    return reader.value(told["tree"])


class _Writer:
    """Takes a value apart, each object and array once."""

    def __init__(self, table: Table, skipped: set[tuple[int, str]]) -> None:
        self._table, self._skipped = table, skipped
        self._object_of: dict[int, int] = {}
        self._array_of: dict[int, int] = {}
        self.objects: list[dict[str, Any]] = []
        self.arrays: list[Array] = []

    def node(self, value: Any) -> Any:
        """Return what stands for a value."""
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, np.generic):
            return value.item()
        if isinstance(value, np.ndarray):
            return {"array": self._array(value)}
        if isinstance(value, slice):
            return {"slice": [value.start, value.stop, value.step]}
        if isinstance(value, tuple | list):
            kind = "tuple" if isinstance(value, tuple) else "list"
            return {kind: [self.node(item) for item in value]}
        if isinstance(value, dict):
            return {"dict": [[self.node(key), self.node(item)] for key, item in value.items()]}
        return {"object": self._object(value)}

    def _array(self, value: Array) -> int:
        if id(value) not in self._array_of:
            self._array_of[id(value)] = len(self.arrays)
            self.arrays.append(value)
        return self._array_of[id(value)]

    def _object(self, value: Any) -> int:
        if type(value) not in self._table:
            raise TypeError(f"a {type(value).__name__} cannot be stored")
        if id(value) not in self._object_of:
            self._object_of[id(value)] = len(self.objects)
            entry: dict[str, Any] = {"class": type(value).__name__, "has": {}}
            self.objects.append(entry)
            for name in self._table[type(value)]:
                skip = (id(value), name) in self._skipped
                entry["has"][name] = None if skip else self.node(getattr(value, name))
        return self._object_of[id(value)]


class _Reader:
    """Puts a value together again."""

    def __init__(
        self, arrays: list[Array], classes: Mapping[str, type], objects: list[dict[str, Any]]
    ) -> None:
        self._arrays = arrays
        self.made: list[Any] = [object.__new__(classes[entry["class"]]) for entry in objects]

    def value(self, node: Any) -> Any:
        """Return what a node stands for."""
        if not isinstance(node, dict):
            return node
        ((kind, content),) = node.items()
        if kind == "array":
            return self._arrays[content]
        if kind == "slice":
            return slice(*content)
        if kind == "tuple":
            return tuple(self.value(item) for item in content)
        if kind == "list":
            return [self.value(item) for item in content]
        if kind == "dict":
            return {self.value(key): self.value(item) for key, item in content}
        if kind == "object":
            return self.made[content]
        raise ValueError("unknown node")
