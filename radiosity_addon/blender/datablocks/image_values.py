"""Mean colors of images, in linear scene colors."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from ...base import drain

_ENCODED = ("sRGB", "AgX Base sRGB", "Filmic sRGB")
_BAND_ROWS = 256  # rows decoded at a time: bounds the temporaries of a large image


ImageKey = tuple[str, bool]
"""An image's full name, and whether it is equirectangular."""

ImageMeans = dict[ImageKey, "np.ndarray | None"]


class UnknownMeanError(Exception):
    """An image's mean is needed but not known yet; computing it now would take too long."""

    def __init__(self, wanted: ImageKey) -> None:
        super().__init__(wanted[0])
        self.wanted = wanted


_known: list[ImageMeans | None] = []


@contextmanager
def known_means_only(means: ImageMeans | None) -> Iterator[None]:
    """Have `image_mean` look means up, and raise `UnknownMeanError` where there is none.

    With None it takes 0 for all of them: where it only counts that something is an image.
    """
    _known.append(means)
    try:
        yield
    finally:
        _known.pop()


def image_mean(image: bpy.types.Image, equirectangular: bool = False) -> np.ndarray | None:
    """Return the mean of an image's pixels, as `image_mean_steps` does; see `known_means_only`."""
    if _known:
        means, wanted = _known[-1], (image.name_full, equirectangular)
        if means is None:
            return np.zeros(4)
        if wanted not in means:
            raise UnknownMeanError(wanted)
        return means[wanted]
    return drain(image_mean_steps(image, equirectangular))


def mean_of_named(wanted: ImageKey) -> Generator[float, None, np.ndarray | None]:
    """Return an image's mean, found by its name; None if there is none of that name any more."""
    image = next((each for each in bpy.data.images if each.name_full == wanted[0]), None)
    return None if image is None else (yield from image_mean_steps(image, wanted[1]))


def pixels_of(image: bpy.types.Image) -> np.ndarray | None:
    """Return (height, width, channels) float32 pixels as the image stores them; None if it has none."""
    width, height = image.size
    if width * height * image.channels == 0:
        return None
    pixels = np.empty(width * height * image.channels, dtype=np.float32)
    try:
        image.pixels.foreach_get(pixels)
    except (RuntimeError, TypeError):  # a file that Blender names but cannot decode
        return None
    return pixels.reshape(height, width, image.channels)


def image_mean_steps(
    image: bpy.types.Image, equirectangular: bool = False
) -> Generator[float, None, np.ndarray | None]:
    """Compute the mean of an image's pixels, converted to linear first; only the first step reads the image.

    equirectangular: Weight each row by the solid angle it covers on the sphere.
    Returns (4,), linear RGB and alpha, not weighted by alpha; None for an image without pixels.
    """
    rows = pixels_of(image)
    if rows is None:
        return None
    height, _, channels = rows.shape
    encoded = not image.is_float and image.colorspace_settings.name in _ENCODED
    yield 0.0
    # Only byte images hold encoded values; float buffers are linear in memory.
    linear = linear_from_srgb(np.arange(256) / 255.0)
    weights = _row_weights(height, equirectangular)
    mean = np.zeros(channels)
    for start in range(0, height, _BAND_ROWS):
        band = rows[start : start + _BAND_ROWS]
        means = band.mean(axis=1, dtype=np.float64)
        if encoded:
            codes = np.rint(np.clip(band[..., :3], 0.0, 1.0) * 255.0).astype(np.uint8)
            means[:, :3] = linear[codes].mean(axis=1)
        mean += weights[start : start + _BAND_ROWS] @ means
        yield start / height
    return _as_rgba(np.nan_to_num(mean, posinf=0.0, neginf=0.0))


def linear_from_srgb(values: np.ndarray) -> np.ndarray:
    """Decode sRGB values of any shape (IEC 61966-2-1)."""
    return np.where(values <= 0.04045, values / 12.92, ((np.maximum(values, 0.0) + 0.055) / 1.055) ** 2.4)


def _row_weights(height: int, equirectangular: bool) -> np.ndarray:
    if not equirectangular:
        return np.full(height, 1.0 / height)
    sine = np.sin((np.arange(height) + 0.5) / height * np.pi)
    return sine / sine.sum()


def _as_rgba(mean: np.ndarray) -> np.ndarray:
    if len(mean) < 3:
        return np.array([mean[0], mean[0], mean[0], mean[1] if len(mean) == 2 else 1.0])
    return mean if len(mean) == 4 else np.append(mean, 1.0)
