"""Kernels and what they read, as files: objects of our classes by their digests, arrays apart.

An object is JSON with its class, its attributes, and the digests of the objects and arrays that it holds.
So what many calls share is written once, and a process that has read it keeps it. Reading makes objects of
the array rooms' classes alone, and calls nothing but their own `__setstate__`.
"""

from __future__ import annotations

import base64
import hashlib
import importlib
import json
import math
from collections.abc import Callable, MutableMapping
from functools import cached_property, partial
from threading import Lock
from types import FunctionType, MethodType
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ..rays import RayCount

Array = npt.NDArray[Any]
Tree = Any
"""What JSON can hold."""

PACKAGE = __name__.rpartition(".farm.")[0]
"""The package's name, which differs from installation to installation."""

ROOMS = ("numerics", "rays", "form_factors", "lights", "scene", "solver", "lightmap")
"""Rooms whose classes and functions may be named, …"""

ALSO_NAMED = ("base.bake_warning:BakeWarning",)
"""… these classes, which scenes and results hold, …"""

NOT_NAMED = "lightmap.charts"
"""… except those that start processes and give meshes to xatlas, which trusts them: no kernel needs any."""

INLINE_BYTES = 1 << 10
"""Smaller arrays are a part of their object."""

KINDS = "biuf"
"""NumPy's letters for the types of arrays that are stored: truth values and numbers."""

_LOCK_TYPE = type(Lock())


class ObjectError(ValueError):
    """What was read is not what `Writer` writes."""


class Store(Protocol):
    """Keeps objects and arrays by their digests."""

    def put_object(self, digest: str, text: str) -> None:
        """Keep an object, if it is not there."""

    def put_array(self, array: Array) -> str:
        """Keep an array, if it is not there; return its digest."""

    def object(self, digest: str) -> str:
        """Return an object's JSON. Raises ObjectError if it is not as it was put in."""

    def array(self, digest: str) -> Array:
        """Return an array that cannot be written to. Raises ObjectError as above."""


def digest_of(text: str) -> str:
    """Return the digest of an object's JSON."""
    return hashlib.blake2b(text.encode(), digest_size=20).hexdigest()


def array_digest(array: Array) -> str:
    """Return the digest of an array's type, shape and numbers."""
    array = np.ascontiguousarray(array)
    digest = hashlib.blake2b(f"{array.dtype.str}{array.shape}".encode(), digest_size=20)
    if array.size:
        digest.update(array.reshape(-1).view(np.uint8).data)
    return digest.hexdigest()


class DigestsAlone:
    """A store that keeps nothing: what is written to it gets the digests that it would have elsewhere."""

    def put_object(self, digest: str, text: str) -> None:
        """See `Store`."""

    def put_array(self, array: Array) -> str:
        """See `Store`."""
        return array_digest(array)

    def object(self, digest: str) -> str:
        """See `Store`."""
        raise ObjectError(f"object {digest} was not kept")

    def array(self, digest: str) -> Array:
        """See `Store`."""
        raise ObjectError(f"array {digest} was not kept")


class Writer:
    """Writes a value, and the objects and arrays it holds, to a store.

    ray_counts: Those of the casters among them, by the names that they get.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self.ray_counts: dict[str, RayCount] = {}
        self._known: dict[int, Tree] = {}
        self._open: set[int] = set()
        self._alive: list[Any] = []

    def tree(self, value: Any) -> Tree:
        """Return what JSON can hold of a value.

        Raises TypeError if it holds anything but plain values, arrays of numbers, functions and objects of
            the array rooms.
        """
        if value is None or isinstance(value, bool | str) or type(value) in (int, float):
            return value
        if isinstance(value, int):
            return int(value)
        if isinstance(value, np.generic):
            return {"scalar": _inline(np.asarray(value))}
        if isinstance(value, np.ndarray):
            return self._array(value)
        if isinstance(value, slice):
            return {"slice": [value.start, value.stop, value.step]}
        if type(value) in (tuple, list):
            return {type(value).__name__: [self.tree(item) for item in value]}
        if isinstance(value, tuple):
            return {"record": [name_of(type(value)), [self.tree(item) for item in value]]}
        if type(value) is dict:
            return {"dict": [[self.tree(key), self.tree(item)] for key, item in value.items()]}
        if isinstance(value, partial):
            return {"partial": [self.tree(value.func), self.tree(value.args), self.tree(value.keywords)]}
        if isinstance(value, MethodType):
            return {"method": [self.tree(value.__self__), value.__name__]}
        if isinstance(value, FunctionType):
            return {"function": name_of(value)}
        return self._object(value)

    def _array(self, array: Array) -> Tree:
        if array.dtype.kind not in KINDS:
            raise TypeError(f"arrays of {array.dtype} cannot be stored")
        return _inline(array) if array.nbytes < INLINE_BYTES else {"array": self._store.put_array(array)}

    def _object(self, value: Any) -> Tree:
        if isinstance(value, _LOCK_TYPE):
            return {"lock": None}
        if id(value) in self._known:
            return self._known[id(value)]
        if id(value) in self._open:
            raise TypeError(f"a {type(value).__name__} holds itself")
        self._open.add(id(value))
        state = state_of(value)
        text = json.dumps([name_of(type(value)), None if state is None else self.tree(state)])
        digest = digest_of(text)
        self._store.put_object(digest, text)
        self._known[id(value)] = {"object": digest}
        self._alive.append(value)
        if (count := _ray_count(value)) is not None:
            count.name = digest
            self.ray_counts[digest] = count
        return self._known[id(value)]


class Reader:
    """Makes values of what `Writer` wrote; objects that several values share are made once.

    known: Objects made before, by their digests; takes those made now.
    """

    def __init__(self, store: Store, known: MutableMapping[str, Any] | None = None) -> None:
        self._store, self._known = store, {} if known is None else known

    def value(self, tree: Tree) -> Any:
        """Return the value of a tree. Raises ObjectError if `Writer` cannot have written it."""
        try:
            return self._value(tree)
        except (
            ValueError,
            KeyError,
            TypeError,
            IndexError,
            AttributeError,
            RecursionError,
            ImportError,
        ) as error:
            raise error if isinstance(error, ObjectError) else ObjectError(str(error)) from error

    def _value(self, tree: Tree) -> Any:
        if not isinstance(tree, dict):
            if isinstance(tree, list):
                raise ObjectError("a list without a kind")
            return tree
        ((kind, content),) = tree.items()
        make = _MAKERS.get(kind)
        if make is not None:
            return make(content)
        if kind == "array":
            return self._store.array(content)
        if kind in ("tuple", "list"):
            items = [self._value(item) for item in content]
            return tuple(items) if kind == "tuple" else items
        if kind == "record":
            return tuple.__new__(named(content[0]), [self._value(item) for item in content[1]])
        if kind == "dict":
            return {self._value(key): self._value(item) for key, item in content}
        if kind == "partial":
            function, given, by_name = map(self._value, content)
            return partial(function, *given, **by_name)
        if kind == "method":
            return self._method(*content)
        if kind == "object":
            return self._object(content)
        raise ObjectError(f"unknown kind '{kind}'")

    def _method(self, owner: Tree, name: str) -> Any:
        found = self._value(owner)
        if not isinstance(getattr(type(found), name, None), FunctionType) or name.startswith("__"):
            raise ObjectError(f"no method '{name}'")
        return getattr(found, name)

    def _object(self, digest: str) -> Any:
        found = self._known.get(digest)
        if found is not None:
            return found
        name, state = json.loads(self._store.object(digest))
        kind = named(name)
        if not isinstance(kind, type):
            raise ObjectError(f"'{name}' is no class")
        result: Any = object.__new__(kind)
        restore_state(result, None if state is None else self._value(state))
        if (count := _ray_count(result)) is not None:
            count.name = digest
        self._known[digest] = result
        return result


def name_of(what: type | FunctionType) -> str:
    """Return the name of one of our classes or functions. Raises TypeError if it is none."""
    module = what.__module__ or ""
    room = module.removeprefix(f"{PACKAGE}.")
    name = f"{room}:{what.__qualname__}"
    if room == module or not _may_be_named(name) or "." in what.__qualname__:
        raise TypeError(f"'{module}.{what.__qualname__}' cannot be stored")
    return name


def named(name: str) -> Any:
    """Return the class or function of a name. Raises ObjectError if it is none of ours."""
    room, _, what = name.partition(":")
    if not _may_be_named(name) or not all(part.isidentifier() for part in room.split(".")):
        raise ObjectError(f"'{name}' may not be named")
    found = getattr(importlib.import_module(f"{PACKAGE}.{room}"), what, None)
    if not isinstance(found, type | FunctionType) or name_of(found) != name or _is_unsafe(found):
        raise ObjectError(f"'{name}' may not be named")
    return found


def _may_be_named(name: str) -> bool:
    room = name.partition(":")[0]
    if name in ALSO_NAMED:
        return True
    return room.split(".")[0] in ROOMS and not f"{room}.".startswith(f"{NOT_NAMED}.")


def _is_unsafe(what: type | FunctionType) -> bool:
    return isinstance(what, type) and issubclass(what, BaseException)


def state_of(value: Any) -> Any:
    """Return what an object is made of again; cached properties are found again when they are asked for.

    Times that it keeps (`TIMES`) stay here: with them the same work would be another one after a restart.
    """
    kind: Any = type(value)
    if "__getstate__" in _inherited(kind):
        return value.__getstate__()
    slots = [name for each in kind.__mro__ for name in getattr(each, "__slots__", ()) if hasattr(value, name)]
    state = {**{name: getattr(value, name) for name in slots}, **getattr(value, "__dict__", {})}
    is_cached = {name for name in state if isinstance(getattr(kind, name, None), cached_property)}
    left_out = is_cached | set(getattr(kind, "TIMES", ()))
    return {name: part for name, part in state.items() if name not in left_out}


def restore_state(value: Any, state: Any) -> None:
    """Give a new object the state that `state_of` returned. Raises ObjectError if it replaces methods."""
    for name in state if isinstance(state, dict) else ():
        if name.startswith("__") or isinstance(getattr(type(value), name, None), FunctionType):
            raise ObjectError(f"a {type(value).__name__} with another '{name}'")
    if "__setstate__" in _inherited(type(value)):
        value.__setstate__(state)
        return
    for name, part in state.items():
        object.__setattr__(value, name, part)


def _ray_count(value: Any) -> RayCount | None:
    """Return a caster's count of rays; None of anything else."""
    count = getattr(value, "__dict__", {}).get("own_rays")
    return count if isinstance(count, RayCount) else None


def _inherited(kind: type) -> set[str]:
    return {name for each in kind.__mro__ if each is not object for name in vars(each)}


def _inline(array: Array) -> Tree:
    data = base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()
    return {"inline": [array.dtype.str, list(array.shape), data]}


def _of_inline(content: list[Any]) -> Array:
    kind, shape, data = content
    dtype = np.dtype(kind)
    raw = base64.b64decode(data, validate=True)
    if dtype.kind not in KINDS or len(raw) != math.prod(shape) * dtype.itemsize:
        raise ObjectError("an array of another size than it says")
    return np.frombuffer(raw, dtype).reshape(shape)


_MAKERS: dict[str, Callable[[Any], Any]] = {
    "inline": _of_inline,
    "scalar": lambda content: _of_inline(content["inline"])[()],
    "slice": lambda content: slice(*content),
    "function": named,
    "lock": lambda _: Lock(),
}
