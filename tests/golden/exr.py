"""OpenEXR files as the golden references need them: half floats in scan lines, zipped.

Read and written here, no version of Blender has a say in their colors. After the format's description,
"OpenEXR File Layout" (openexr.com).
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

MAGIC, VERSION = 20000630, 2
HALF, ZIP, LINES_A_BLOCK = 1, 3, 16


def write_exr(path: Path, channels: dict[str, np.ndarray]) -> None:
    """Write (height, width) arrays by channel name as half floats; row 0 is the bottom."""
    names = sorted(channels)
    planes = np.stack([np.asarray(channels[name])[::-1].astype("<f2") for name in names], axis=1)
    height, _, width = planes.shape
    blocks = []
    for first in range(0, height, LINES_A_BLOCK):
        raw = planes[first : first + LINES_A_BLOCK].tobytes()
        packed = zlib.compress(_predicted(raw), 9)
        data = packed if len(packed) < len(raw) else raw
        blocks.append(struct.pack("<ii", first, len(data)) + data)
    header = _header(names, width, height)
    place = len(header) + 8 * len(blocks)
    offsets = []
    for block in blocks:
        offsets.append(struct.pack("<Q", place))
        place += len(block)
    path.write_bytes(header + b"".join(offsets) + b"".join(blocks))


def read_exr(path: Path) -> dict[str, np.ndarray]:
    """Read what `write_exr` wrote: (height, width) float32 by channel name, row 0 at the bottom."""
    file = path.read_bytes()
    if struct.unpack_from("<ii", file) != (MAGIC, VERSION):
        raise ValueError(f"{path} is not a plain OpenEXR file")
    attributes, place = _attributes(file)
    left, bottom, right, top = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, top - bottom + 1
    names = _channel_names(attributes["channels"])
    count = -(-height // LINES_A_BLOCK)
    lines = []
    for (start,) in struct.iter_unpack("<Q", file[place : place + 8 * count]):
        first, size = struct.unpack_from("<ii", file, start)
        data = file[start + 8 : start + 8 + size]
        rows = min(LINES_A_BLOCK, height - first)
        full = rows * len(names) * width * 2
        raw = data if size == full else _unpredicted(zlib.decompress(data))
        lines.append(np.frombuffer(raw, dtype="<f2").reshape(rows, len(names), width))
    planes = np.concatenate(lines)[::-1].astype(np.float32)
    return {name: planes[:, number].copy() for number, name in enumerate(names)}


def _header(names: list[str], width: int, height: int) -> bytes:
    listed = b"".join(name.encode() + b"\0" + struct.pack("<iB3xii", HALF, 0, 1, 1) for name in names)
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


def _attributes(file: bytes) -> tuple[dict[str, bytes], int]:
    """Return the header's values by name, and where the table of offsets begins."""
    values, place = {}, 8
    while file[place]:
        name_end = file.index(b"\0", place)
        kind_end = file.index(b"\0", name_end + 1)
        (size,) = struct.unpack_from("<i", file, kind_end + 1)
        values[file[place:name_end].decode()] = file[kind_end + 5 : kind_end + 5 + size]
        place = kind_end + 5 + size
    return values, place + 1


def _channel_names(listed: bytes) -> list[str]:
    names, place = [], 0
    while listed[place]:
        end = listed.index(b"\0", place)
        names.append(listed[place:end].decode())
        place = end + 17
    return names


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
