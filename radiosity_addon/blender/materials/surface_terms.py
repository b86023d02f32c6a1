"""From the terms of shaders to a surface that is there or not: reflectance, emission, opacity."""

from __future__ import annotations

import numpy as np

LEAST_EMITTING = 1 / 64
"""Opacity of what glows but hides nothing: only what is there can emit."""


LEAST_COLOR = 1e-4
"""What passes has a color if its channels differ by more than this."""


def surface_of_terms(
    reflected: np.ndarray, radiance: np.ndarray, passed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Divide what a surface does to light by how much of it is there.

    reflected, radiance, passed (..., 3): As in `Terms`.
    Returns reflectance, radiance (..., 3): Of the surface where it is there; 0 where nothing is.
    Returns opacity (...,) float in [0, 1].
    """
    opacity = np.clip(1.0 - np.nan_to_num(passed.mean(axis=-1)), 0.0, 1.0)
    glows = (opacity < LEAST_EMITTING) & (radiance > 0).any(axis=-1)
    opacity = np.where(glows, LEAST_EMITTING, opacity)
    there = np.where(opacity > 0, opacity, 1.0)[..., None]
    return reflected / there, radiance / there, opacity


def passing_color(passed: np.ndarray, opacity: np.ndarray) -> np.ndarray:
    """Return (..., 3) what passes by channel, with 1 − opacity as its mean; gray stays exactly that."""
    gray = np.repeat((1.0 - opacity)[..., None], 3, axis=-1)
    color = np.clip(np.nan_to_num(passed), 0.0, 1.0)
    mean = color.mean(axis=-1, keepdims=True)
    colored = np.ptp(color, axis=-1, keepdims=True) > LEAST_COLOR
    return np.where(colored, np.minimum(color * gray / np.where(mean > 0, mean, 1.0), 1.0), gray)
