"""The object that takes nearly all texels: a higher resolution would not help the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

GREEDY = 0.9
"""An object that takes more of the texels leaves little for the others."""


def greedy_object(names: Sequence[str], texels: Sequence[float]) -> str | None:
    """Return the object that takes nearly all of the texels; None if there is none, or only one object."""
    if len(names) < 2 or max(texels) <= GREEDY * sum(texels):
        return None
    return names[int(np.argmax(texels))]


def share_of(part: float, whole: float) -> str:
    """Return a share in percent as text; 100 % only where it is all."""
    percent = f"{part / whole:.1%}"
    return "more than 99.9 %" if percent == "100.0%" and part < whole else percent.replace("%", " %")
