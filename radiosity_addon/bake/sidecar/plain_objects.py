"""Objects of known classes as plain values and arrays, and back: what a file can hold.

A class declares what is stored of it in `STORED`, a tuple of public attributes; a dataclass without it stores
all of its fields. Objects are made again without calling anything of theirs: what was read cannot run.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def stored_names(kind: Any) -> tuple[str, ...]:
    """Return the attributes that are stored of a class."""
    declared: tuple[str, ...] | None = getattr(kind, "STORED", None)
    return tuple(entry.name for entry in fields(kind)) if declared is None else declared


def flatten(value: Any, kinds: Collection[type]) -> tuple[Any, list[Array]]:
    """Return what JSON can hold of a value, and the arrays it refers to.

    Parameters
    ----------
    kinds : collection of types
        The classes that may be stored.

    Raises
    ------
    TypeError
        If it holds anything else.
    """
    arrays: list[Array] = []

    def node(value: Any) -> Any:
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, np.generic):
            return value.item()
        if isinstance(value, np.ndarray):
            arrays.append(value)
            return {"array": len(arrays) - 1}
        if isinstance(value, slice):
            return {"slice": [value.start, value.stop, value.step]}
        if isinstance(value, tuple | list):
            kind = "tuple" if isinstance(value, tuple) else "list"
            return {kind: [node(item) for item in value]}
        if isinstance(value, dict):
            return {"dict": [[node(key), node(item)] for key, item in value.items()]}
        if type(value) not in kinds:
            raise TypeError(f"a {type(value).__name__} cannot be stored")
        names = stored_names(type(value))
        return {"object": [type(value).__name__, {name: node(getattr(value, name)) for name in names}]}

    return node(value), arrays


def restore(tree: Any, arrays: list[Array], kinds: Collection[type]) -> Any:
    """Return the value that `flatten` took apart; fields of dataclasses that are not stored are None.

    Raises
    ------
    ValueError, KeyError, TypeError, IndexError, RecursionError
        If it is not as `flatten` would write it.
    """
    class_of: Mapping[str, type] = {kind.__name__: kind for kind in kinds}

    def value(node: Any) -> Any:
        if not isinstance(node, dict):
            return node
        ((kind, content),) = node.items()
        if kind == "array":
            return arrays[content]
        if kind == "slice":
            return slice(*content)
        if kind == "tuple":
            return tuple(value(item) for item in content)
        if kind == "list":
            return [value(item) for item in content]
        if kind == "dict":
            return {value(key): value(item) for key, item in content}
        if kind == "object":
            name, stored = content
            return made(class_of[name], stored)
        raise ValueError("unknown node")

    def made(kind: type, stored: Mapping[str, Any]) -> Any:
        if set(stored) != set(stored_names(kind)):
            raise ValueError("other attributes than these")
        result: Any = object.__new__(kind)
        if is_dataclass(kind):
            for entry in fields(kind):
                object.__setattr__(result, entry.name, None)
        for name, node in stored.items():
            object.__setattr__(result, name, value(node))
        return result

    return value(tree)
