"""A file of numbers and arrays with a digest of its content; reading it runs nothing.

The head is a few bytes of magic, the format's number, and a digest of all that follows: a description in
JSON, then arrays in blocks. Where these are compressed, bytes of equal weight lie together (the first of
every number, then the second …), which halves what integers and fractions of about the same size take.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import struct
import zlib
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from ..base import BakeError

Array = npt.NDArray[Any]

BLOCK_BYTES = 1 << 22
"""Bytes of an array that are compressed at a time: blocks are independent, a thread each."""

LEVEL = 1
"""Of zlib: more takes several times as long for a tenth less."""

ARRAY_TYPES = (
    "bool",
    "int8",
    "int16",
    "int32",
    "int64",
    "uint8",
    "uint16",
    "uint32",
    "uint64",
    "float16",
    "float32",
    "float64",
)
"""Types of arrays that may be stored: plain numbers, never objects."""

MAX_FILE_BYTES = 1 << 38
"""Bytes that a file may claim to hold, unless the caller allows fewer."""

RATIO, SPARE = 32, 1 << 24
"""Arrays may take this many times the bytes of their file, and these more. Those of a bake take about three
times as many; zlib itself can pack a thousand to one."""

HEAD_RATIO, HEAD_SPARE = 64, 1 << 20
"""The same for the description."""

MOST_HEAD = 1 << 26
"""Bytes of a description at most."""

MOST_AXES = 8
"""Of an array."""

_HEAD = struct.Struct("<16sI32sQ")

_DAMAGED = (
    *(ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError),
    *(RecursionError, MemoryError, zlib.error, struct.error),
)
"""What reading a file that is not as it was written can raise."""


class ArrayFileError(BakeError):
    """A file that cannot be used; the message says what is wrong with it, without its name."""


class TooLargeError(ArrayFileError):
    """A file that may be whole but takes more memory than is allowed."""


def write_arrays(
    path: Path, magic: bytes, format_number: int, description: Any, arrays: list[Array], level: int = LEVEL
) -> int:
    """Write a description and arrays; return the bytes that they take.

    magic: 16 of them at most: the kind of file.
    description: What JSON can hold.
    arrays list of arrays of the `ARRAY_TYPES`.
    level: Of zlib; 0 leaves arrays as they are, for files that are read once.
    Raises OSError if the file cannot be written.
    """
    with ThreadPoolExecutor() as threads:
        compressed = partial(_compressed, level=level)
        blocks = [list(threads.map(compressed, _blocks(array))) for array in arrays]
    entries = [
        {
            "kind": array.dtype.name,
            "shape": list(array.shape),
            "blocks": [len(block) for block in array_blocks],
        }
        for array, array_blocks in zip(arrays, blocks, strict=True)
    ]
    told = {"description": description, "arrays": entries, **({} if level else {"plain": True})}
    head = zlib.compress(json.dumps(told).encode())
    body = [head, *(block for array_blocks in blocks for block in array_blocks)]
    digest = hashlib.blake2b(digest_size=32)
    for part in body:
        digest.update(part)
    with path.open("wb") as file:
        file.write(_HEAD.pack(magic, format_number, digest.digest(), len(head)))
        file.writelines(body)
        return file.tell()


def read_arrays(
    path: Path, magic: bytes, format_number: int, most: int = MAX_FILE_BYTES
) -> tuple[Any, list[Array]]:
    """Read what `write_arrays` wrote.

    most: Bytes that it may take in memory; what would take more is refused before it is unpacked.
    Raises OSError if the file cannot be read.
    Raises ArrayFileError if it is of another kind or format, not as it was written, or too large.
    """
    with _opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        _check_head(file.read(_HEAD.size), magic, format_number)
        if size > most:
            raise TooLargeError(f"it has {size >> 20} MB, more than the memory limit of {most >> 20} MB")
        file.seek(0)
        content = file.read(size)
    digest, length = _check_head(content, magic, format_number)
    body = memoryview(content)[_HEAD.size :]
    if hashlib.blake2b(body, digest_size=32).digest() != digest:
        raise ArrayFileError("it is damaged")
    try:
        head = json.loads(_unpacked(body[:length], min(HEAD_RATIO * length + HEAD_SPARE, MOST_HEAD)))
        entries, room = head["arrays"], min(RATIO * len(body) + SPARE, MAX_FILE_BYTES)
        total = _total(entries)
        if total > room:
            raise ArrayFileError(f"it claims to hold {total >> 20} MB, which a file of its size cannot")
        if total > most:
            raise TooLargeError(f"it takes {total >> 20} MB, more than the memory limit of {most >> 20} MB")
        return head["description"], _read(body[length:], entries, plain=bool(head.get("plain")))
    except _DAMAGED as error:
        raise ArrayFileError("it is damaged") from error


def read_digest(path: Path, magic: bytes, format_number: int) -> str:
    """Return the digest that a file's head holds, without reading the rest; errors as of `read_arrays`."""
    with _opened(path) as file:
        return _check_head(file.read(_HEAD.size), magic, format_number)[0].hex()


def _opened(path: Path) -> BinaryIO:
    """Open a file to read; a device or a pipe, which may have no end, is none."""
    if path.exists() and not path.is_file():
        raise ArrayFileError("it is not a sidecar")
    return path.open("rb")


def _check_head(content: bytes, magic: bytes, format_number: int) -> tuple[bytes, int]:
    """Return the digest and the description's length that a file's first bytes hold."""
    if not magic.ljust(16, b"\0").startswith(content[:16]):
        raise ArrayFileError("it is not a sidecar")
    if len(content) < _HEAD.size:
        raise ArrayFileError("it is incomplete")
    _, found, digest, length = _HEAD.unpack_from(content)
    if found != format_number:
        raise ArrayFileError(f"it has format {found}, and this version reads format {format_number}")
    return digest, length


def _unpacked(packed: memoryview, most: int) -> bytes:
    """Expand bytes, to at most `most`."""
    expander = zlib.decompressobj()
    content = expander.decompress(packed, most + 1)
    if len(content) > most or not expander.eof:
        raise ValueError("too long, or incomplete")
    return content


def _total(entries: list[dict[str, Any]]) -> int:
    """Return the bytes that arrays would take, which may be any number."""
    total = 0
    for entry in entries:
        if entry["kind"] not in ARRAY_TYPES or len(entry["shape"]) > MOST_AXES:
            raise ValueError("unknown kind of array")
        count = 1
        for size in entry["shape"]:
            if type(size) is not int or not 0 <= size <= MAX_FILE_BYTES:
                raise ValueError("impossible shape")
            count *= size
        total += count * np.dtype(entry["kind"]).itemsize
    return total


def _blocks(array: Array) -> list[Array]:
    """Cut an array into flat blocks."""
    if array.dtype.name not in ARRAY_TYPES:
        raise TypeError(f"arrays of {array.dtype} cannot be stored")
    flat = np.ascontiguousarray(array).reshape(-1)
    step = BLOCK_BYTES // array.dtype.itemsize
    return [flat[first : first + step] for first in range(0, len(flat), step)]


def _compressed(block: Array, level: int) -> bytes:
    if not level:
        return block.tobytes()
    width = block.dtype.itemsize
    planes = np.ascontiguousarray(block.view(np.uint8).reshape(-1, width).T)
    return zlib.compress(planes.data, level)


def _read(body: memoryview, entries: list[dict[str, Any]], plain: bool) -> list[Array]:
    """Return the arrays that entries describe."""
    made, jobs, at = [], [], 0
    for entry in entries:
        dtype, shape = np.dtype(entry["kind"]), tuple(entry["shape"])
        count = math.prod(shape)
        step = BLOCK_BYTES // dtype.itemsize
        if len(entry["blocks"]) != -(-count // step):
            raise ValueError("impossible array")
        flat = np.empty(count, dtype=dtype)
        made.append(flat.reshape(shape))
        for number, size in enumerate(entry["blocks"]):
            if type(size) is not int or not 0 <= size <= len(body) - at:
                raise ValueError("impossible block")
            jobs.append((flat[number * step : (number + 1) * step], body[at : at + size]))
            at += size
    if at != len(body):
        raise ValueError("more or less than was described")
    with ThreadPoolExecutor() as threads:
        list(threads.map(_copy if plain else _expand, jobs))
    return made


def _copy(job: tuple[Array, memoryview]) -> None:
    """Fill a block from its bytes."""
    target, stored = job
    _fill(target, np.frombuffer(stored, dtype=np.uint8).reshape(-1, target.dtype.itemsize))


def _expand(job: tuple[Array, memoryview]) -> None:
    """Fill a block from its compressed bytes."""
    target, packed = job
    # No more is unpacked than there is room for, whatever the bytes say.
    content = np.frombuffer(_unpacked(packed, target.nbytes), dtype=np.uint8)
    _fill(target, content.reshape(target.dtype.itemsize, -1).T)


def _fill(target: Array, numbers: Array) -> None:
    """Fill a block from the bytes (n, width) of its numbers."""
    if numbers.size != target.nbytes:
        raise ValueError("too short")
    if target.dtype == np.bool_ and (numbers > 1).any():
        raise ValueError("neither true nor false")
    target.view(np.uint8).reshape(numbers.shape)[:] = numbers
