"""PNG files as small as they get without a loss: pictures are kept in the repository."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

GREY, RGB = 0, 2


def write_png(path: Path, pixels: np.ndarray) -> None:
    """Write (h, w, 3) display values in [0, 1] with 8 bits a channel, row 0 at the bottom."""
    values = np.round(np.clip(pixels[::-1], 0.0, 1.0) * 255.0).astype(np.uint8)
    grey = bool((values == values[..., :1]).all())
    values = values[..., :1] if grey else values
    height, width, channels = values.shape
    rows = values.reshape(height, width * channels).astype(np.int16)
    lines = b"".join(_filtered(rows, number, channels) for number in range(height))
    header = struct.pack(">IIBBBBB", width, height, 8, GREY if grey else RGB, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(lines, 9)), (b"IEND", b""))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in chunks))


def _filtered(rows: np.ndarray, number: int, channels: int) -> bytes:
    """Return a row as its differences from what is left, above, or both, whichever are smallest.

    After the format's description: filter types 0, 1, 2 and 4 (Paeth).
    """
    row = rows[number]
    above = rows[number - 1] if number else np.zeros_like(row)
    left, corner = (np.concatenate([np.zeros(channels, np.int16), line[:-channels]]) for line in (row, above))
    guess = left + above - corner
    apart = np.abs(np.stack([guess - left, guess - above, guess - corner]))
    nearest = apart.argmin(axis=0)
    paeth = np.choose(nearest, [left, above, corner])
    tried = {0: row, 1: row - left, 2: row - above, 4: row - paeth}
    kind = min(tried, key=lambda one: _size(tried[one]))
    return bytes([kind]) + tried[kind].astype(np.uint8).tobytes()


def _size(differences: np.ndarray) -> int:
    """Return how far a row's bytes are from 0, either way: a good guess at how well it packs."""
    return int(np.abs(differences.astype(np.int8).astype(np.int16)).sum())


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
