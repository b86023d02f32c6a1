"""Open Image Denoise on a noisy lightmap, as the popular baking add-ons do."""

from __future__ import annotations

import numpy as np
import pyoidn

from radiosity_addon.lightmap.images.dilate import dilate


def denoised(pixels: np.ndarray, coverage: np.ndarray, filter_type: str) -> np.ndarray:
    """Return (n, n, 3) float32.

    Parameters
    ----------
    pixels : (n, n, 3) float32
    coverage : (n, n) bool
        Where there is a surface. What is between the charts is filled first, so that no black seeps in.
    filter_type : "RTLightmap", which is trained on lightmaps, or "RT", which is trained on pictures
    """
    filled = dilate(pixels, coverage)
    return pyoidn.denoise(filled, hdr=True, filter_type=filter_type)
