"""Pictures as PNG files as small as they get without a loss: some are kept in the repository."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image


def write_png(path: Path, pixels: np.ndarray) -> None:
    """Write (h, w, 3) display values in [0, 1] with 8 bits a channel, row 0 at the bottom."""
    values = np.round(np.clip(pixels[::-1], 0.0, 1.0) * 255.0).astype(np.uint8)
    if (values == values[..., :1]).all():
        values = np.ascontiguousarray(values[..., 0])
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(values).save(path, optimize=True)
