"""RGBM: 8-bit PNG images of light, for engines and viewers that read no HDR images.

After Karis, "RGBM color encoding" (2009), without gamma: light = range · alpha · color, both of 0 to 1. Where
a texel is brighter than a 255th of the range, no channel is off by more than a 255th of the largest.
"""

from __future__ import annotations

import numpy as np

from ..numerics import Array
from .png8 import png_of_bytes

STEPS = 255.0

SMALLEST_RANGE = 1e-6
"""Of an image that is black."""


def encode_rgbm(colors: Array) -> tuple[Array, float]:
    """Encode an image (height, width, 3) of light.

    Returns encoded (height, width, 4) uint8: Alpha is never 0, for programs that multiply colors by it.
    Returns range: The light of the whitest texel with an alpha of 1.
    """
    light = np.maximum(np.nan_to_num(np.asarray(colors, dtype=np.float64), posinf=0.0), 0.0)
    largest = max(float(light.max(initial=0.0)), SMALLEST_RANGE)
    # The smallest multiplier that reaches a texel: its color then uses most of the 255 steps.
    multiplier = np.clip(np.ceil(STEPS * light.max(axis=-1) / largest - 1e-9), 1.0, STEPS)
    color = np.rint(np.minimum(light / (largest * multiplier[..., None] / STEPS), 1.0) * STEPS)
    return np.concatenate([color, multiplier[..., None]], axis=-1).astype(np.uint8), largest


def decode_rgbm(encoded: Array, largest: float) -> Array:
    """Return the light (..., 3) float32 of what `encode_rgbm` returned."""
    values = encoded.astype(np.float32) / np.float32(STEPS)
    light: Array = np.float32(largest) * values[..., 3:] * values[..., :3]
    return light


def write_rgbm(colors: Array) -> tuple[bytes, float]:
    """Return the PNG file of an image (height, width, 3), row 0 at the bottom, and its range."""
    encoded, largest = encode_rgbm(colors)
    return png_of_bytes(encoded), largest
