"""Tasks: a few slices of a kernel's rows, and what they found as a file."""

from __future__ import annotations

import math
import time
from collections.abc import MutableMapping
from functools import partial
from typing import Any

import numpy as np

from ..rays import counted_apart
from .objects import ObjectError, Reader, Writer, digest_of, name_of
from .signs import this_process
from .spool import Spool

MOST_TASKS = 256
"""Tasks of a call, about: each is a file, and a claim."""

KERNELS = frozenset(
    (
        "solver.gather.final_gather:_trace",
        "solver.gather.footprints:_at_centers",
        "solver.gather.footprints:_varying",
        "solver.gather.group_shadows:_first_rays",
        "solver.gather.group_shadows:_learned_rays",
        "solver.gather.retracing:_retrace",
        "solver.gather.run_gains:_seen_of_run",
        "solver.gather.soft_shadows:_shadowed",
        "lightmap.points.interpolation:_supported",
        "lightmap.points.smoothing:_alike",
        "lightmap.texels.occlusion:_find",
    )
)
"""Those whose work is more than what they read and find. Sweeps are not among them: they read all texels'
radiosity, which is new each time, to add up a few numbers for each. Nor are places in texels, which are
quickly found, and how points speak for texels in the end: a third of what a large bake would move."""


def is_kernel(function: Any) -> bool:
    """Return whether a function may be run as a task."""
    try:
        return name_of(function) in KERNELS
    except (TypeError, AttributeError):
        return False


def read_kernel(
    spool: Spool, digest: str, known: MutableMapping[str, Any] | None = None
) -> tuple[partial[Any], list[list[int]]]:
    """Return a call's kernel and the bounds of its slices.

    known: Objects that were made before; takes further ones.
    Raises ObjectError if the call cannot be read, or is of something else.
    """
    call = spool.call(digest)
    try:
        tree, bounds = call["kernel"], call["slices"]
        possible = all(type(end) is int and end >= 0 for start, stop in bounds for end in (start, stop))
    except (KeyError, TypeError, ValueError) as error:
        raise ObjectError(str(error)) from error
    work = Reader(spool, known).value(tree)
    if not possible or not isinstance(work, partial) or not is_kernel(work.func):
        raise ObjectError("a call of something that is no kernel")
    return work, bounds


class _ResultStore:
    """Keeps objects in a dictionary and arrays in a list: what goes into one file."""

    def __init__(self, objects: dict[str, str] | None = None, arrays: list[Any] | None = None) -> None:
        self.objects: dict[str, str] = {} if objects is None else objects
        self.arrays: list[Any] = [] if arrays is None else arrays

    def put_object(self, digest: str, text: str) -> None:
        self.objects[digest] = text

    def put_array(self, array: Any) -> str:
        self.arrays.append(array)
        return str(len(self.arrays) - 1)

    def object(self, digest: str) -> str:
        text = self.objects[digest]
        if digest_of(text) != digest:
            raise ObjectError(f"object {digest} is damaged")
        return text

    def array(self, digest: str) -> Any:
        return self.arrays[int(digest)]


def slices_of_task(slices: int) -> int:
    """Return how many slices of a call make a task."""
    return max(1, slices // MOST_TASKS)


def task_count(slices: int) -> int:
    """Return how many tasks a call of so many slices has."""
    return -(-slices // slices_of_task(slices))


def run_task(
    spool: Spool, digest: str, task: int, work: partial[Any], bounds: list[list[int]]
) -> tuple[list[Any], dict[str, int]]:
    """Run a kernel for the slices of a task, write what they found, and return it.

    Returns also the rays that it took, by the names of their counts.
    """
    step, started = slices_of_task(len(bounds)), time.thread_time()
    with counted_apart() as rays:
        found = [work(slice(*pair)) for pair in bounds[task * step : (task + 1) * step]]
    store = _ResultStore()
    tree = Writer(store).tree(found)
    # Of truth values and numbers; a scalar's array has no axis.
    arrays = [np.ascontiguousarray(array) for array in store.arrays]
    done = {"seconds": time.thread_time() - started, "by": this_process(), "rays": rays}
    spool.put_result(digest, task, {"found": tree, "objects": store.objects, **done}, arrays)
    return found, rays


def values_of(description: Any, arrays: list[Any]) -> tuple[list[Any], float, str, dict[str, int]]:
    """Return what the slices of a task found, its processor seconds, by which process, and its rays.

    Raises ObjectError if it is not as `run_task` wrote it.
    """
    try:
        store = _ResultStore(description["objects"], arrays)
        found = Reader(store).value(description["found"])
        seconds, by = float(description["seconds"]), str(description["by"])
        rays = {str(name): int(count) for name, count in description["rays"].items()}
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise ObjectError(str(error)) from error
    if not isinstance(found, list) or not 0 <= seconds < math.inf:
        raise ObjectError("no list of results")
    return found, seconds, by, rays
