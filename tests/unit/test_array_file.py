"""Files of arrays: what comes back is what was written, and what was not written so is refused."""

from __future__ import annotations

import json
import os
import struct
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.numerics import array_file
from radiosity_addon.numerics.array_file import ArrayFileError, TooLargeError, read_arrays, write_arrays

MAGIC = b"TESTS"
ARRAYS = [
    np.arange(2_500_000, dtype=np.int32).reshape(-1, 2),  # more than a block
    np.array([[0.5, -0.0], [np.inf, 1e-300]]),
    np.zeros((0, 3), dtype=np.float32),
    np.array([True, False, True]),
    np.asfortranarray(np.arange(6.0).reshape(2, 3)),
]


@pytest.fixture(params=[array_file.LEVEL, 0], ids=["compressed", "plain"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    file = tmp_path / "some.arrays"
    size = write_arrays(file, MAGIC, 3, {"told": ["ä", 0.1]}, ARRAYS, request.param)
    assert size == file.stat().st_size
    return file


def test_arrays_come_back_as_they_were(path: Path) -> None:
    told, arrays = read_arrays(path, MAGIC, 3)
    assert told == {"told": ["ä", 0.1]}
    for found, expected in zip(arrays, ARRAYS, strict=True):
        assert found.dtype == expected.dtype
        np.testing.assert_array_equal(found, expected)
        assert found.flags.writeable


@pytest.mark.parametrize("path", [array_file.LEVEL], indirect=True)
def test_numbers_of_about_one_size_take_less_than_they_are(path: Path) -> None:
    assert path.stat().st_size < 0.5 * sum(array.nbytes for array in ARRAYS)


def test_a_plain_file_takes_what_its_arrays_take(tmp_path: Path) -> None:
    size = write_arrays(tmp_path / "some.arrays", MAGIC, 3, None, ARRAYS, level=0)
    arrays = sum(array.nbytes for array in ARRAYS)
    assert arrays < size < arrays + 400


@pytest.mark.parametrize("share", [0.0, 0.00001, 0.3, 0.999999])
def test_what_is_cut_off_is_refused(path: Path, share: float) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(ArrayFileError, match=r"incomplete|damaged"):
        read_arrays(path, MAGIC, 3)


@pytest.mark.parametrize("at", [22, 54, 70, 5000, -1], ids=["digest", "length", "head", "array", "end"])
def test_a_flipped_bit_is_noticed(path: Path, at: int) -> None:
    content = bytearray(path.read_bytes())
    content[at] ^= 4
    path.write_bytes(content)
    with pytest.raises(ArrayFileError, match="damaged"):
        read_arrays(path, MAGIC, 3)


def test_other_kinds_and_formats_are_refused(path: Path) -> None:
    with pytest.raises(ArrayFileError, match="not a"):
        read_arrays(path, b"OTHERS", 3)
    with pytest.raises(ArrayFileError, match=r"format 3.*format 4"):
        read_arrays(path, MAGIC, 4)


def forged(path: Path, head: dict, body: bytes) -> None:
    """Write a file whose digest is right, whatever is in it."""
    packed = zlib.compress(json.dumps(head).encode(), 1)
    digest = array_file.hashlib.blake2b(packed + body, digest_size=32).digest()
    path.write_bytes(struct.pack("<16sI32sQ", MAGIC, 3, digest, len(packed)) + packed + body)


@pytest.mark.parametrize(
    "entry",
    [
        {"kind": "object", "shape": [1], "blocks": [0]},
        {"kind": "float64", "shape": [1 << 60], "blocks": [0]},
        {"kind": "float64", "shape": [-1], "blocks": [0]},
        {"kind": "float64", "shape": [2], "blocks": [99]},
        {"kind": "float64", "shape": [2]},
        "nothing of the kind",
    ],
    ids=["objects", "too large", "negative", "not there", "no blocks", "no entry"],
)
def test_a_file_that_was_forged_is_refused(tmp_path: Path, entry: object) -> None:
    path = tmp_path / "forged"
    forged(path, {"description": None, "arrays": [entry]}, b"")
    with pytest.raises(ArrayFileError, match="damaged"):
        read_arrays(path, MAGIC, 3)


@pytest.fixture(scope="module")
def zeros() -> bytes:
    """100 MB of them, packed."""
    return zlib.compress(bytes(100_000_000), 1)


@pytest.mark.parametrize("claimed", [4, 5_000_000, 10_000_000, 1 << 35])
def test_bombs_are_refused_before_anything_of_their_size_is_allocated(
    tmp_path: Path, zeros: bytes, claimed: int
) -> None:
    """100 MB of zeros in half a megabyte, and claims that a file of this size cannot keep."""
    path, packed = tmp_path / "bomb", zeros
    blocks = [len(packed)] * -(-claimed // array_file.BLOCK_BYTES)
    forged(
        path,
        {"description": None, "arrays": [{"kind": "uint8", "shape": [claimed], "blocks": blocks}]},
        packed,
    )
    tracemalloc.start()
    with pytest.raises(ArrayFileError, match=r"damaged|cannot"):
        read_arrays(path, MAGIC, 3)
    assert tracemalloc.get_traced_memory()[1] < 50_000_000
    tracemalloc.stop()


def test_a_description_that_is_a_bomb_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb"
    forged(path, {"description": " " * 150_000_000, "arrays": []}, b"")
    tracemalloc.start()
    with pytest.raises(ArrayFileError, match="damaged"):
        read_arrays(path, MAGIC, 3)
    assert tracemalloc.get_traced_memory()[1] < 100_000_000
    tracemalloc.stop()
    forged(path, json.loads("[" * 900 + "]" * 900), b"")  # type: ignore[arg-type]
    with pytest.raises(ArrayFileError, match="damaged"):
        read_arrays(path, MAGIC, 3)


@pytest.mark.parametrize("path", [array_file.LEVEL], indirect=True)
def test_what_exceeds_the_memory_that_is_allowed_is_refused(path: Path) -> None:
    total = sum(array.nbytes for array in ARRAYS)
    read_arrays(path, MAGIC, 3, most=total)
    for most in (total - 1, path.stat().st_size - 1):
        with pytest.raises(TooLargeError, match="memory limit"):
            read_arrays(path, MAGIC, 3, most=most)


def test_what_is_no_file_is_refused_at_once(tmp_path: Path) -> None:
    """A pipe that nobody writes to would be waited for without end."""
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero"), tmp_path):
        with pytest.raises(ArrayFileError, match="not a"):
            read_arrays(path, MAGIC, 3)


def test_objects_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="cannot be stored"):
        write_arrays(tmp_path / "some", MAGIC, 3, None, [np.array([object()])])
