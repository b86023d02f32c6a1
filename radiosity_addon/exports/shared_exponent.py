"""RGB9E5: three mantissas of 9 bits and an exponent of 5 that they share, in 32 bits.

After "EXT_texture_shared_exponent" (Khronos Group, 2006), sections 3.8.x and its function `float3_to_rgb9e5`.
The largest channel is off by at most 2⁻⁹ of itself, each other one by as much of the largest.
"""

from __future__ import annotations

import numpy as np

from ..numerics import Array

MANTISSA_BITS, BIAS, MAX_EXPONENT = 9, 15, 31
LARGEST = (2**MANTISSA_BITS - 1) / 2**MANTISSA_BITS * 2.0 ** (MAX_EXPONENT - BIAS)
"""The largest value: 65408."""


def encode_rgb9e5(colors: Array) -> Array:
    """Return (…,) uint32 of colors (…, 3); what is negative, or too large, is clamped, and NaN is 0."""
    clamped = np.clip(np.nan_to_num(np.asarray(colors, dtype=np.float64), posinf=LARGEST), 0.0, LARGEST)
    largest = clamped.max(axis=-1)
    # frexp: x = m · 2^e with m in [½, 1), so that floor(log2 x) = e − 1, without rounding.
    exponent = np.maximum(np.frexp(largest)[1] - 1, -BIAS - 1) + 1 + BIAS
    exponent = np.where(largest > 0.0, exponent, 0)
    unit = np.ldexp(1.0, exponent - BIAS - MANTISSA_BITS)
    overflows = np.floor(largest / unit + 0.5) == 2**MANTISSA_BITS
    exponent = exponent + overflows
    unit = np.where(overflows, 2.0 * unit, unit)
    mantissas = np.floor(clamped / unit[..., None] + 0.5).astype(np.uint32)
    packed = mantissas[..., 0] | mantissas[..., 1] << 9 | mantissas[..., 2] << 18
    return packed | exponent.astype(np.uint32) << 27


def decode_rgb9e5(packed: Array) -> Array:
    """Return colors (…, 3) float32 of (…,) uint32."""
    packed = np.asarray(packed, dtype=np.uint32)
    mantissas = np.stack([packed >> shift & 511 for shift in (0, 9, 18)], axis=-1)
    exponent = (packed >> 27).astype(np.int32) - BIAS - MANTISSA_BITS
    return np.ldexp(mantissas.astype(np.float32), exponent[..., None])
