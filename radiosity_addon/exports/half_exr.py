"""OpenEXR images of half floats: RGB in zipped scan lines, which every engine reads.

After "OpenEXR File Layout" (openexr.com). Half the size of 32-bit floats, with a relative error below 2⁻¹¹.
Blender's writer would add the date, so that no two files were the same.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

from ..numerics import Array

MAGIC, VERSION = 20000630, 2
HALF, ZIP, LINES_A_BLOCK = 1, 3, 16
CHANNELS = "BGR"
"""In the file's order, which is that of the alphabet."""

LARGEST = 65504.0
"""Of half floats; what is larger is clamped."""


def write_half_exr(colors: Array) -> bytes:
    """Return the file of an image (height, width, 3), row 0 at the bottom."""
    height, width = colors.shape[:2]
    clamped = np.clip(np.nan_to_num(colors, posinf=LARGEST, neginf=-LARGEST), -LARGEST, LARGEST)
    planes = clamped[::-1, :, ::-1].astype("<f2").transpose(0, 2, 1)
    blocks = []
    for first in range(0, height, LINES_A_BLOCK):
        raw = planes[first : first + LINES_A_BLOCK].tobytes()
        packed = zlib.compress(_predicted(raw), 6)
        data = packed if len(packed) < len(raw) else raw
        blocks.append(struct.pack("<ii", first, len(data)) + data)
    header = _header(width, height)
    places = len(header) + 8 * len(blocks) + np.cumsum([0, *map(len, blocks[:-1])])
    return b"".join((header, places.astype("<u8").tobytes(), *blocks))


def read_half_exr(file: bytes) -> Array:
    """Return the image (height, width, 3) float32 of what `write_half_exr` wrote, row 0 at the bottom.

    Raises ValueError if it is anything else.
    """
    if len(file) < 8 or struct.unpack_from("<ii", file) != (MAGIC, VERSION):
        raise ValueError("not a plain OpenEXR file")
    place = file.index(b"dataWindow\0box2i\0") + 21
    left, bottom, right, top = struct.unpack_from("<4i", file, place)
    width, height = right - left + 1, top - bottom + 1
    count = -(-height // LINES_A_BLOCK)
    table = len(_header(width, height))
    lines = []
    for (start,) in struct.iter_unpack("<Q", file[table : table + 8 * count]):
        first, size = struct.unpack_from("<ii", file, start)
        rows = min(LINES_A_BLOCK, height - first)
        data = file[start + 8 : start + 8 + size]
        raw = data if size == rows * len(CHANNELS) * width * 2 else _unpredicted(zlib.decompress(data))
        lines.append(np.frombuffer(raw, dtype="<f2").reshape(rows, len(CHANNELS), width))
    return np.concatenate(lines)[::-1, ::-1].transpose(0, 2, 1).astype(np.float32)


def _header(width: int, height: int) -> bytes:
    listed = b"".join(name.encode() + b"\0" + struct.pack("<iB3xii", HALF, 0, 1, 1) for name in CHANNELS)
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = [
        (b"channels", b"chlist", listed + b"\0"),
        (b"compression", b"compression", bytes([ZIP])),
        (b"dataWindow", b"box2i", window),
        (b"displayWindow", b"box2i", window),
        (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1.0)),
        (b"screenWindowCenter", b"v2f", struct.pack("<2f", 0.0, 0.0)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1.0)),
    ]
    body = b"".join(
        name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
        for name, kind, value in attributes
    )
    return struct.pack("<ii", MAGIC, VERSION) + body + b"\0"


def _predicted(raw: bytes) -> bytes:
    """Return low bytes before high ones, each as its difference from the byte before, plus 128."""
    data = np.frombuffer(raw, dtype=np.uint8)
    apart = np.concatenate([data[0::2], data[1::2]])
    apart[1:] = np.diff(apart) + np.uint8(128)
    return apart.tobytes()


def _unpredicted(data: bytes) -> bytes:
    apart = np.frombuffer(data, dtype=np.uint8).copy()
    apart[1:] -= np.uint8(128)
    apart = np.cumsum(apart, dtype=np.uint8)
    raw = np.empty_like(apart)
    raw[0::2], raw[1::2] = apart[: (len(raw) + 1) // 2], apart[(len(raw) + 1) // 2 :]
    return raw.tobytes()
