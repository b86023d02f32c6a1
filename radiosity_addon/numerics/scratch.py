"""Large arrays within a memory budget: beyond it they are stored in temporary files and processed in tiles.

An array in a file is an ordinary array over a memory map. The pages of a map that were read or written stay
in memory until `trim` drops them, which `parallel.map_chunks` calls after every chunk: what is in memory is
the tile that is being worked on. Values are the same wherever an array lives, so results are the same bytes.
The files have no name: they are gone when the arrays are, however the process ends.
"""

from __future__ import annotations

import contextlib
import errno
import math
import mmap
import os
import tempfile
import threading
import weakref
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
import numpy.typing as npt

from ..base import BakeError
from .arrays import Array
from .heap import give_back

MIN_FILE_BYTES = 1 << 20
"""Smaller arrays stay in memory, and are not counted [bytes]."""

TILE = 1 << 18
"""Rows of an array that `tiles` yields at once."""

PENDING = 1 << 22
"""Numbers that `Rows.extend` collects before it makes a block of them."""

_maps: weakref.WeakSet[mmap.mmap] = weakref.WeakSet()
_lock = threading.Lock()


class Scratch:
    """Makes arrays: in memory as long as the budget lasts, then in files.

    budget: What the arrays may take of memory together [bytes].
    """

    def __init__(self, budget: float = math.inf) -> None:
        self.budget = budget
        self.free: Callable[[], float] | None = None
        """Returns the memory that the rest of the process leaves for arrays, if known [bytes]."""
        self.in_memory = 0
        """Memory that the arrays use now [bytes]."""
        self.in_files = 0
        """Space that arrays in files have used so far [bytes]."""

    def __getstate__(self) -> None:
        """Another process has a budget of its own."""

    def __setstate__(self, state: object) -> None:
        self.__init__()  # type: ignore[misc]

    def empty(self, shape: int | Sequence[int], dtype: npt.DTypeLike = np.float64) -> Array:
        """Return an uninitialized array."""
        size = math.prod(shape) if isinstance(shape, Sequence) else shape
        size *= np.dtype(dtype).itemsize
        if size < MIN_FILE_BYTES:
            return np.empty(shape, dtype)
        if size <= self.room():
            return self.counted(np.empty(shape, dtype))
        self.in_files += size
        with _temporary_file() as file:
            return _mapped(file, 0, shape, dtype)

    def zeros(self, shape: int | Sequence[int], dtype: npt.DTypeLike = np.float64) -> Array:
        """Return an array of zeros."""
        result = self.empty(shape, dtype)
        for rows in tiles(len(result)):
            result[rows] = 0
        return result

    def room(self) -> float:
        """Return the memory that further arrays may use [bytes]."""
        left = self.budget - self.in_memory
        return left if self.free is None else min(left, self.free())

    def give_back(self) -> None:
        """Give back what a step freed, unless arrays of the next one would take it: its temporaries need it.

        They would not where memory is ample, nor where there is none left for arrays.
        """
        if not self.in_files or self.room() <= 0:
            give_back()

    def rows(self, width: int, dtype: npt.DTypeLike) -> Rows:
        """Return a table that grows by blocks of rows."""
        return Rows(self, width, dtype)

    def counted(self, array: Array) -> Array:
        """Count an array in memory until it is freed."""
        if array.nbytes < MIN_FILE_BYTES:
            return array
        with _lock:
            self.in_memory += array.nbytes
        weakref.finalize(array, self._uncount, array.nbytes)
        return array

    def _uncount(self, size: int) -> None:
        with _lock:
            self.in_memory -= size


class Rows:
    """A table of rows that is filled block by block and then used as one array."""

    def __init__(self, scratch: Scratch, width: int, dtype: npt.DTypeLike) -> None:
        self._scratch, self._width, self._dtype = scratch, width, np.dtype(dtype)
        self._blocks: list[Array] = []
        self._pending: list[Array] = []
        self._count = self._waiting = 0
        self._file: BinaryIO | None = None

    def __len__(self) -> int:
        return self._count + self._waiting

    def more(self, count: int) -> Array:
        """Return the next `count` rows, uninitialized."""
        start, row = self._count, self._width * self._dtype.itemsize
        self._count += count
        # Blocks in memory are joined at the end: those whose memory is not freed at once exist twice then.
        size = self._count * row
        if self._file is None and size >= MIN_FILE_BYTES and size + count * row > self._scratch.room():
            self._file = _temporary_file()
        if self._file is None or count == 0:
            block = self._scratch.counted(np.empty((count, self._width), self._dtype))
        else:
            self._scratch.in_files += count * row
            block = _mapped(self._file, start * row, (count, self._width), self._dtype)
        self._blocks.append(block)
        return block

    def extend(self, values: Array) -> None:
        """Add rows of any shape with as many numbers as the table is wide."""
        self._pending.append(values)
        self._waiting += len(values)
        if self._waiting * self._width >= PENDING:
            self._write()

    def _write(self) -> None:
        pending, self._pending, count, self._waiting = self._pending, [], self._waiting, 0
        if count:
            block = self.more(count)
            np.concatenate([values.reshape(-1, self._width) for values in pending], out=block)

    def all(self) -> Array:
        """Return all rows as one array, and release the blocks."""
        self._write()
        blocks, self._blocks = self._blocks, []
        shape = (self._count, self._width)
        if self._file is None:
            # An array takes memory where it is written: with each block that moves over one is freed.
            joined, end = np.empty(shape, self._dtype), self._count
            while blocks:
                block = blocks.pop()
                joined[end - len(block) : end] = block
                end -= len(block)
                del block
            return self._scratch.counted(joined)
        with self._file:
            result = _mapped(self._file, 0, shape, self._dtype)
        start = 0
        for block in blocks:
            if not is_in_file(block):
                result[start : start + len(block)] = block
            start += len(block)
        trim()
        return result


def tiles(count: int, size: int = 0) -> Iterator[slice]:
    """Yield slices of `size` rows (0: `TILE`) that cover `count`; after each, files leave memory."""
    size = size or TILE
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))
        trim()


def marked(count: int, of: Callable[[slice], Array]) -> Array:
    """Return (count,) bool from a function of rows, evaluated tile by tile."""
    result = np.empty(count, dtype=bool)
    for rows in tiles(count):
        result[rows] = of(rows)
    return result


def row_numbers(mask: Array) -> Array:
    """Return where a mask is true, as int32: half of what `np.flatnonzero` takes."""
    parts = [(rows.start + np.flatnonzero(mask[rows])).astype(np.int32) for rows in tiles(len(mask))]
    return np.concatenate(parts) if parts else np.zeros(0, np.int32)


def is_in_file(array: Array) -> bool:
    """Return whether an array, or its base, is stored in a file."""
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    base = base.obj if isinstance(base, memoryview) else base
    return isinstance(base, mmap.mmap)


def trim() -> None:
    """Drop the pages of arrays in files from memory; the files keep them."""
    if not _maps or not hasattr(mmap, "MADV_DONTNEED"):
        return
    with _lock:
        alive = list(_maps)
    for each in alive:
        with contextlib.suppress(ValueError, OSError):
            each.madvise(mmap.MADV_DONTNEED)


def folder() -> Path:
    """Return where the files are made: TMPDIR, or where the system keeps large temporary files."""
    if "TMPDIR" not in os.environ and os.access("/var/tmp", os.W_OK):
        return Path("/var/tmp")
    return Path(tempfile.gettempdir())


def _temporary_file() -> BinaryIO:
    try:
        return cast(BinaryIO, tempfile.TemporaryFile(dir=folder(), buffering=0))
    except OSError as error:
        raise BakeError(f"cannot make a temporary file in '{folder()}': {error.strerror}") from error


def _mapped(file: BinaryIO, start: int, shape: int | Sequence[int], dtype: npt.DTypeLike) -> Array:
    """Return an array over part of a file, which is made as large as that takes."""
    size = math.prod(shape) if isinstance(shape, Sequence) else shape
    size *= np.dtype(dtype).itemsize
    if size == 0:
        return np.empty(shape, dtype)
    _reserve(file, start + size)
    before = start % mmap.ALLOCATIONGRANULARITY
    mapped = mmap.mmap(file.fileno(), before + size, offset=start - before)
    with _lock:
        _maps.add(mapped)
    return np.frombuffer(mapped, dtype, offset=before, count=size // np.dtype(dtype).itemsize).reshape(shape)


def _reserve(file: BinaryIO, end: int) -> None:
    """Make room on the disk now: a full disk met through a map kills the process."""
    size = os.fstat(file.fileno()).st_size
    if end <= size:
        return
    try:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), size, end - size)
            return
        file.seek(size)
        zeros = bytes(1 << 24)
        for at in range(size, end, len(zeros)):
            file.write(zeros[: end - at])
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT):
            raise
        raise BakeError(
            f"no room for {end / 2**30:.1f} GiB of temporary files in '{folder()}': free some, set TMPDIR to "
            "another folder, raise the memory limit or lower the resolution"
        ) from error
