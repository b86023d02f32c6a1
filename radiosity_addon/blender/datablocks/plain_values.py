"""What datablocks, and structs in them, hold, as plain data that can be compared and hashed."""

from __future__ import annotations

from collections.abc import Callable, Collection
from operator import attrgetter
from typing import Any, TypeAlias

import bpy

Reader: TypeAlias = Callable[[Any], Any]
Readers: TypeAlias = tuple[Reader, tuple[tuple[str, Reader], ...]]

SIMPLE = frozenset((bool, int, float, str, type(None)))
"""Types of values that are plain data."""


class StructReader:
    """Reads properties of structs, and of the structs that are part of them; datablocks count by name.

    within: Names of properties that do not count where a struct is part of another.
    prefixes: What names of properties that do not count begin with.
    """

    def __init__(self, within: frozenset[str], prefixes: tuple[str, ...]) -> None:
        self._within, self._prefixes = within, prefixes
        # Properties can be registered at any time.
        self._known: dict[tuple[type, frozenset[str], int], Readers] = {}

    def read(self, struct: Any, without: Collection[str]) -> list[Any]:
        """Return what a struct's properties hold."""
        simple, others = self.readers(type(struct), frozenset(without))
        return [simple(struct), *(read(getattr(struct, name)) for name, read in others)]

    def readers(self, kind: Any, without: frozenset[str]) -> Readers:
        """Return how to get the plain properties of a kind of struct that count, and each of the others."""
        key = kind, without, len(kind.bl_rna.properties)
        if key not in self._known:
            self._known[key] = self._find(kind, without)
        return self._known[key]

    def names(self, kind: Any, without: Collection[str]) -> tuple[str, ...]:
        """Return the names of the properties of a kind of struct that count."""
        return tuple(prop.identifier for prop in self._counted(kind, without))

    def _counted(self, kind: Any, without: Collection[str]) -> list[bpy.types.Property]:
        return [
            prop
            for prop in kind.bl_rna.properties
            if prop.identifier != "rna_type"
            and (prop.type in ("COLLECTION", "POINTER") or not prop.is_readonly)
            and prop.identifier not in without
            and not prop.identifier.startswith(self._prefixes)
        ]

    def _find(self, kind: Any, without: frozenset[str]) -> Readers:
        simple: list[str] = []
        others: list[tuple[str, Reader]] = []
        for prop in self._counted(kind, without):
            if prop.type == "COLLECTION":
                others.append((prop.identifier, self._items))
            elif prop.type == "POINTER":
                others.append((prop.identifier, self._pointer))
            elif getattr(prop, "is_array", False) or getattr(prop, "is_enum_flag", False):
                others.append((prop.identifier, plain))
            else:
                simple.append(prop.identifier)
        return (attrgetter(*simple) if simple else _nothing), tuple(others)

    def _items(self, values: Any) -> list[Any]:
        return [self._pointer(value) for value in values]

    def _pointer(self, value: Any) -> Any:
        if value is None or isinstance(value, (bpy.types.ID, bpy.types.Node, bpy.types.NodeSocket)):
            return plain(value)
        return self.read(value, self._within)


def custom_properties(owner: Any, without: Collection[str]) -> list[tuple[str, Any]]:
    """Return the custom properties, except for some and those that are registered."""
    known = owner.bl_rna.properties
    keys = [key for key in sorted(owner.keys()) if key not in without and key not in known]
    return [(key, plain(owner[key])) for key in keys]


def plain(value: Any) -> Any:
    """Return a value of a property as plain data."""
    if type(value) in SIMPLE:
        return value
    if type(value) is bpy.types.bpy_prop_array and not isinstance(value[0], bpy.types.bpy_prop_array):
        return value[:]
    if isinstance(value, bpy.types.ID):
        return (value.id_type, value.name_full)
    if isinstance(value, bpy.types.bpy_struct):
        return getattr(value, "name", "")
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    if hasattr(value, "to_dict"):
        return repr(value.to_dict())
    return [plain(item) for item in value]


def _nothing(_: Any) -> None:
    return None
