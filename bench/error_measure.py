"""The error of a bake, measured against two independent noisy references."""

from __future__ import annotations

import numpy as np


def relative_rmse(values: np.ndarray, first: np.ndarray, second: np.ndarray) -> float:
    """Return √(mean (x − r₁)(x − r₂)) / mean r: the product of independent errors has no noise floor."""
    x, r_1, r_2 = (array.astype(np.float64) for array in (values, first, second))
    square = ((x - r_1) * (x - r_2)).mean()
    return float(np.sqrt(max(square, 0.0)) / (0.5 * (r_1 + r_2)).mean())


def error_figures(values: np.ndarray, first: np.ndarray, second: np.ndarray) -> dict[str, float]:
    """Return what is said of a bake's error.

    Parameters
    ----------
    values, first, second : (n, 3) float
        The compared texels of the bake and of the two references.

    Returns
    -------
    dict
        "relative_rmse"; "error": the same, but at least what these can distinguish from 0, which is
        what times are compared at; "uncertainty": its standard error by the texels' spread;
        "mean_ratio": mean of the bake by that of the references;
        "percentile_99": of |x − r| / mean r, r the mean of both references, whose noise it includes;
        "without_worst_1", "without_worst_01": the error without the 1 % and 0.1 % of texels with the
        largest products, which separates a few bad texels from noise everywhere.
    """
    x, r_1, r_2 = (array.astype(np.float64) for array in (values, first, second))
    reference = 0.5 * (r_1 + r_2)
    mean = reference.mean()
    raw = relative_rmse(values, first, second)
    # Channels of a texel err together: a texel is one sample.
    products = ((x - r_1) * (x - r_2)).mean(axis=1)
    spread = products.std() / np.sqrt(len(products)) / mean**2
    error = max(raw, np.sqrt(spread))
    ordered = np.sort(products)
    kept = {name: ordered[: len(ordered) - int(len(ordered) * share)].mean()
            for name, share in (("without_worst_1", 0.01), ("without_worst_01", 0.001))}  # fmt: skip
    return {
        **{name: float(np.sqrt(max(square, 0.0)) / mean) for name, square in kept.items()},
        "relative_rmse": raw,
        "error": float(error),
        "uncertainty": float(spread / (2 * error)) if error > 0 else 0.0,
        "mean_ratio": float(x.mean() / mean),
        "percentile_99": float(np.quantile(np.abs(x - reference).max(axis=1), 0.99) / mean),
    }


BLOCK = 8
"""Side [texels] of the blocks whose means show blotches."""


def block_error(pixels: np.ndarray, first: np.ndarray, second: np.ndarray, compared: np.ndarray) -> float:
    """Return the relative RMSE of the means over blocks of 8 × 8 texels, each at least half compared.

    Parameters
    ----------
    pixels, first, second : (n, n, 3) float
    compared : (n, n) bool
    """
    side = len(compared) // BLOCK
    shape = (side, BLOCK, side, BLOCK)
    counts = compared[: side * BLOCK, : side * BLOCK].reshape(shape).sum(axis=(1, 3))
    full = counts >= BLOCK * BLOCK // 2
    if not full.any():
        return 0.0
    means = []
    for page in (pixels, first, second):
        masked = np.where(compared[..., None], page, 0.0)[: side * BLOCK, : side * BLOCK].astype(np.float64)
        means.append(masked.reshape(*shape, 3).sum(axis=(1, 3))[full] / counts[full, None])
    return relative_rmse(*means)
