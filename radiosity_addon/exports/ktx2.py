"""KTX 2.0 files of RGB9E5 images: VK_FORMAT_E5B9G9R9_UFLOAT_PACK32, one level, zstd where that is there.

After the "KTX File Format Specification 2.0" (Khronos Group) and the basic block of the "Khronos Data Format
Specification 1.3". Rows run from the top, as engines expect of KTX2.
"""

from __future__ import annotations

import importlib.util
import struct
from typing import Any

import numpy as np

from ..numerics import Array
from .shared_exponent import decode_rgb9e5, encode_rgb9e5

MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"
E5B9G9R9 = 123
PLAIN, ZSTD = 0, 2
LEVEL = 18
"""Of zstd: higher ones take much longer and gain a percent."""

_HEADER = struct.Struct("<9I")
_INDEX = struct.Struct("<4I2Q")
_LEVEL_ENTRY = struct.Struct("<3Q")


def write_ktx2(colors: Array) -> bytes:
    """Return the file of an image (height, width, 3), row 0 at the bottom."""
    height, width = colors.shape[:2]
    raw = encode_rgb9e5(colors[::-1]).astype("<u4").tobytes()
    zstd = _zstd()
    data = raw if zstd is None else zstd.ZstdCompressor(level=LEVEL).compress(raw)
    descriptor, notes = _descriptor(), _key_values()
    first = len(MAGIC) + _HEADER.size + _INDEX.size + _LEVEL_ENTRY.size
    head = first + len(descriptor) + len(notes)
    padding = -head % 4 if zstd is None else 0
    header = _HEADER.pack(E5B9G9R9, 4, width, height, 0, 0, 1, 1, PLAIN if zstd is None else ZSTD)
    index = _INDEX.pack(first, len(descriptor), first + len(descriptor), len(notes), 0, 0)
    level = _LEVEL_ENTRY.pack(head + padding, len(data), len(raw))
    return b"".join((MAGIC, header, index, level, descriptor, notes, bytes(padding), data))


def read_ktx2(file: bytes) -> Array:
    """Return the image (height, width, 3) float32 of what `write_ktx2` wrote, row 0 at the bottom.

    Raises ValueError if it is anything else.
    """
    if not file.startswith(MAGIC):
        raise ValueError("not a KTX2 file")
    kind, _, width, height, _, _, _, levels, scheme = _HEADER.unpack_from(file, len(MAGIC))
    if kind != E5B9G9R9 or levels != 1 or scheme not in (PLAIN, ZSTD):
        raise ValueError("not a KTX2 file of RGB9E5")
    place = len(MAGIC) + _HEADER.size + _INDEX.size
    offset, size, full = _LEVEL_ENTRY.unpack_from(file, place)
    data = file[offset : offset + size]
    if scheme == ZSTD:
        zstd = _zstd()
        if zstd is None:
            raise ValueError("the package zstandard is missing")
        data = zstd.ZstdDecompressor().decompress(data, max_output_size=full)
    return decode_rgb9e5(np.frombuffer(data, "<u4").reshape(height, width))[::-1]


def _zstd() -> Any | None:
    """Return the package zstandard; None where this Python has none."""
    if importlib.util.find_spec("zstandard") is None:
        return None
    return importlib.import_module("zstandard")


def _descriptor() -> bytes:
    """Return the data format descriptor: linear, BT.709, three mantissas that share an exponent."""
    samples = b""
    for channel, offset in enumerate((0, 9, 18)):
        # Twice a channel: its mantissa, and the exponent (qualifier 0x20), as the specification lists them.
        samples += struct.pack("<I4BII", offset | 8 << 16 | channel << 24, 0, 0, 0, 0, 0, 256)
        samples += struct.pack("<I4BII", 27 | 4 << 16 | (channel | 0x20) << 24, 0, 0, 0, 0, 15, 31)
    size = 24 + len(samples)
    block = struct.pack("<IHH", 0, 2, size) + bytes([1, 1, 1, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0])
    return struct.pack("<I", 4 + size) + block + samples


def _key_values() -> bytes:
    """Return who wrote it, and that rows run downward: entries sorted by key, each padded to 4 bytes."""
    entries = b""
    for key, value in ((b"KTXorientation", b"rd"), (b"KTXwriter", b"Radiosity Lightmaps")):
        entry = key + b"\0" + value + b"\0"
        entries += struct.pack("<I", len(entry)) + entry + bytes(-len(entry) % 4)
    return entries
