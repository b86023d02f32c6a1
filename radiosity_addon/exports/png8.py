"""PNG images of 8 bits; encoded in sRGB they are what the glTF standard has for colors.

After "Portable Network Graphics" (W3C), with its filter Paeth's simpler cousin Up: rows are differences from
the row above.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

from ..numerics import Array

SIGNATURE = b"\x89PNG\r\n\x1a\n"
UP = 2


def png_of_linear(colors: Array, alpha: Array | None = None) -> bytes:
    """Return the file of linear colors (height, width, 3) in [0, 1], row 0 at the bottom.

    alpha (height, width): Coverage, stored as it is; None for an image without.
    """
    encoded = np.rint(255.0 * srgb_of_linear(np.clip(colors, 0.0, 1.0))).astype(np.uint8)
    if alpha is not None:
        covered = np.rint(255.0 * np.clip(alpha, 0.0, 1.0)).astype(np.uint8)
        encoded = np.concatenate([encoded, covered[..., None]], axis=-1)
    return png_of_bytes(encoded)


def png_of_bytes(encoded: Array) -> bytes:
    """Return the file of an image (height, width, 3 or 4) uint8, row 0 at the bottom."""
    height, width, channels = encoded.shape
    rows = np.ascontiguousarray(encoded[::-1]).reshape(height, width * channels)
    filtered = np.empty((height, 1 + width * channels), dtype=np.uint8)
    filtered[:, 0], filtered[0, 1:] = UP, rows[0]
    filtered[1:, 1:] = rows[1:] - rows[:-1]
    kind = 2 if channels == 3 else 6
    header = struct.pack(">2I5B", width, height, 8, kind, 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(filtered.tobytes(), 6)), (b"IEND", b""))
    return SIGNATURE + b"".join(_chunk(*part) for part in parts)


def srgb_of_linear(values: Array) -> Array:
    """Encode linear values in [0, 1] (IEC 61966-2-1)."""
    values = np.asarray(values, dtype=np.float64)
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
