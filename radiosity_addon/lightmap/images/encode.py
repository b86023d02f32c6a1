"""The quantities that a lightmap can hold, and their encoding in 16 bits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...base import BakeError, UsageError
from ...numerics import brdf_of_reflectance, reflected_radiance, tiles
from .page import LightmapPage

BAND = 256
"""Rows of a page processed at once."""

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]


def to_quantity(irradiance: Float, reflectance: Float, emission: Float, quantity: str) -> Float:
    """Convert irradiance to the lightmap's quantity.

    irradiance (n, 3): H, what arrives [W/m²], linear RGB.
    reflectance, emission (n, 3): ρ and the self-emitted exitance E [W/m²] at the same points.
    quantity: "irradiance_over_pi": H/π [W/m²/sr], what Cycles' diffuse bake without color holds;
        "irradiance": H [W/m²]; "radiosity": B = E + ρH [W/m²]. A residual is not made of irradiance: see
        `error_picture`.
    Raises UsageError if the quantity is unknown.
    """
    if quantity == "irradiance_over_pi":
        white = brdf_of_reflectance(1.0)
        return reflected_radiance(white, irradiance)
    if quantity == "irradiance":
        return np.asarray(irradiance)
    if quantity == "radiosity":
        return np.asarray(emission + reflectance * irradiance)
    raise UsageError(f"quantity {quantity!r} is not irradiance_over_pi, irradiance or radiosity")


def presentable(pages: Sequence[LightmapPage], signed: bool = False) -> tuple[LightmapPage, ...]:
    """Return pages that may be published: values below 0 by rounding become 0.

    signed: Whether they may be negative, as an error picture is.
    Raises BakeError if a value is NaN or infinite.
    """
    found = []
    for page in pages:
        low, high = page.pixels.min(initial=0.0), page.pixels.max(initial=0.0)
        # Either is NaN where a value is.
        if not (np.isfinite(low) and np.isfinite(high)):
            raise BakeError("the light is not finite somewhere: no lightmap is written; bake again")
        if low < 0.0 and not signed:
            page = replace(page, pixels=np.maximum(page.pixels, 0.0))
        found.append(page)
    return tuple(found)


def png16_scale(*pages: Float32) -> float:
    """Return the one scale for all pages of a bake: their largest value, 1 if all are black.

    Raises BakeError if a value is NaN or infinite.
    """
    largest = 0.0
    for pixels in pages:
        for rows in tiles(len(pixels), BAND):
            if not np.isfinite(pixels[rows]).all():
                raise BakeError("the lightmap holds values that are not finite and cannot be written as PNG")
            largest = max(largest, float(pixels[rows].max(initial=0.0)))
    return largest if largest > 0 else 1.0


def encode_png16(pixels: Float32, scale: float) -> Float32:
    """Return pixels / scale in [0, 1], rounded to the 65536 steps that 16 bits hold.

    A reader multiplies by the scale; half a step, scale / 131070, is the largest error.
    """
    share = np.clip(pixels.astype(np.float64) / scale, 0.0, 1.0)
    return np.asarray(np.rint(share * 65535.0) / 65535.0, dtype=np.float32)
