"""A file of numbers and arrays that tells whether it is whole, and of which reading it runs nothing.

The head is a few bytes of magic, a version, and a digest of all that follows: a description in JSON,
then arrays in compressed blocks. Bytes of equal weight lie together (the first of every number, then the
second …), which halves what integers and fractions of about the same size take.
"""

from __future__ import annotations

import hashlib
import json
import struct
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import BakeError

Array = npt.NDArray[Any]

BLOCK = 1 << 22
"""Bytes of an array that are compressed at a time: blocks are independent, a thread each."""

LEVEL = 1
"""Of zlib: more takes several times as long for a tenth less."""

KINDS = (
    "bool",
    "int8",
    "int16",
    "int32",
    "int64",
    "uint8",
    "uint16",
    "uint32",
    "uint64",
    "float32",
    "float64",
)
"""Types of arrays that may be stored: plain numbers, never objects."""

MOST = 1 << 38
"""Bytes that a file may claim to hold: more is no file of ours."""

_HEAD = struct.Struct("<16sI32sQ")


class ArrayFileError(BakeError):
    """A file that cannot be used; the message says what is wrong with it, without its name."""


def write_arrays(path: Path, magic: bytes, version: int, told: Any, arrays: list[Array]) -> int:
    """Write a description and arrays; return the bytes that they take.

    Parameters
    ----------
    magic : bytes
        16 of them at most: the kind of file.
    told : any
        What JSON can hold.
    arrays : list of arrays of the `KINDS`

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with ThreadPoolExecutor() as threads:
        blocks = [list(threads.map(_compressed, _blocks(array))) for array in arrays]
    entries = [
        {"kind": array.dtype.name, "shape": list(array.shape), "blocks": [len(block) for block in some]}
        for array, some in zip(arrays, blocks, strict=True)
    ]
    head = zlib.compress(json.dumps({"told": told, "arrays": entries}).encode())
    body = [head, *(block for some in blocks for block in some)]
    digest = hashlib.blake2b(digest_size=32)
    for part in body:
        digest.update(part)
    with path.open("wb") as file:
        file.write(_HEAD.pack(magic, version, digest.digest(), len(head)))
        file.writelines(body)
        return file.tell()


def read_arrays(path: Path, magic: bytes, version: int) -> tuple[Any, list[Array]]:
    """Read what `write_arrays` wrote.

    Raises
    ------
    OSError
        If the file cannot be read.
    ArrayFileError
        If it is of another kind or version, or not as it was written.
    """
    content = path.read_bytes()
    if len(content) < _HEAD.size:
        raise ArrayFileError("it is cut off")
    kind, found, digest, length = _HEAD.unpack_from(content)
    if kind != magic.ljust(16, b"\0"):
        raise ArrayFileError("it is no such file")
    if found != version:
        raise ArrayFileError(f"it has version {found}, and this is for version {version}")
    body = memoryview(content)[_HEAD.size :]
    if hashlib.blake2b(body, digest_size=32).digest() != digest:
        raise ArrayFileError("it is damaged")
    try:
        head = json.loads(zlib.decompress(body[:length]))
        return head["told"], _read(body[length:], head["arrays"])
    except (ValueError, KeyError, TypeError, AttributeError, zlib.error, MemoryError) as error:
        raise ArrayFileError("it is damaged") from error


def _blocks(array: Array) -> list[Array]:
    """Cut an array into flat blocks."""
    if array.dtype.name not in KINDS:
        raise TypeError(f"arrays of {array.dtype} cannot be stored")
    flat = np.ascontiguousarray(array).reshape(-1)
    step = BLOCK // array.dtype.itemsize
    return [flat[first : first + step] for first in range(0, len(flat), step)]


def _compressed(block: Array) -> bytes:
    width = block.dtype.itemsize
    planes = np.ascontiguousarray(block.view(np.uint8).reshape(-1, width).T)
    return zlib.compress(planes.tobytes(), LEVEL)


def _read(body: memoryview, entries: list[dict[str, Any]]) -> list[Array]:
    """Return the arrays that entries tell of."""
    made, jobs, at, total = [], [], 0, 0
    for entry in entries:
        if entry["kind"] not in KINDS:
            raise ValueError("unknown type of numbers")
        dtype, shape = np.dtype(entry["kind"]), tuple(int(size) for size in entry["shape"])
        count = int(np.prod(shape, dtype=object))
        total += count * dtype.itemsize
        step = BLOCK // dtype.itemsize
        if min(shape, default=1) < 0 or total > MOST or len(entry["blocks"]) != -(-count // step):
            raise ValueError("impossible array")
        flat = np.empty(count, dtype=dtype)
        made.append(flat.reshape(shape))
        for number, size in enumerate(entry["blocks"]):
            jobs.append((flat[number * step : (number + 1) * step], body[at : at + size]))
            at += size
    if at != len(body):
        raise ValueError("more or less than was told")
    with ThreadPoolExecutor() as threads:
        list(threads.map(_expand, jobs))
    return made


def _expand(job: tuple[Array, memoryview]) -> None:
    """Fill a block from its compressed bytes."""
    target, packed = job
    width = target.dtype.itemsize
    # No more is unpacked than there is room for, whatever the bytes say.
    planes = zlib.decompressobj().decompress(packed, target.nbytes)
    bytes_of = np.frombuffer(planes, dtype=np.uint8).reshape(width, -1)
    target.view(np.uint8).reshape(-1, width)[:] = bytes_of.T
