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
        "percentile_99": of |x − r| / mean r, r the mean of both references, whose noise it includes.
    """
    x, r_1, r_2 = (array.astype(np.float64) for array in (values, first, second))
    reference = 0.5 * (r_1 + r_2)
    mean = reference.mean()
    raw = relative_rmse(values, first, second)
    # Channels of a texel err together: a texel is one sample.
    products = ((x - r_1) * (x - r_2)).mean(axis=1)
    spread = products.std() / np.sqrt(len(products)) / mean**2
    error = max(raw, np.sqrt(spread))
    return {
        "relative_rmse": raw,
        "error": float(error),
        "uncertainty": float(spread / (2 * error)) if error > 0 else 0.0,
        "mean_ratio": float(x.mean() / mean),
        "percentile_99": float(np.quantile(np.abs(x - reference).max(axis=1), 0.99) / mean),
    }
