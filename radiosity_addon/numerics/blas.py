"""NumPy's OpenBLAS on one thread."""

from __future__ import annotations

import ctypes
import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from threading import Lock
from typing import Any

NAMES = ("openblas_{}_num_threads64_", "scipy_openblas_{}_num_threads64_", "openblas_{}_num_threads")

_lock = Lock()
_inside = [0]
_before = [0]


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Have NumPy's products use one thread, in the whole process, for as long as somebody is within.

    What is multiplied here are a few columns at a time, and after each product OpenBLAS's other threads wait
    busily for the next: a sixth of a bake's processor time on two cores (decision 0065). Where NumPy links
    something else, nothing is changed.
    """
    known = thread_functions()
    if known is None:
        yield
        return
    get, put = known
    with _lock:
        if not _inside[0]:
            _before[0] = get()
            put(1)
        _inside[0] += 1
    try:
        yield
    finally:
        with _lock:
            _inside[0] -= 1
            if not _inside[0]:
                put(_before[0])


@cache
def thread_functions() -> tuple[Callable[[], int], Callable[[int], Any]] | None:
    """Return what gets and what sets the number of OpenBLAS's threads; None if NumPy is not linked to it.

    Windows does not look for functions in what a library is linked to, so none are found there.
    """
    with suppress(ImportError, OSError, TypeError):
        library = ctypes.CDLL(importlib.import_module("numpy.linalg._umath_linalg").__file__)
        for name in NAMES:
            with suppress(AttributeError):
                return getattr(library, name.format("get")), getattr(library, name.format("set"))
    return None
