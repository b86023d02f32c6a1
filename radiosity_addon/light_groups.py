"""Light groups: named sets of a scene's sources of light, each with lightmaps of its own."""

from __future__ import annotations

from collections.abc import Generator, Sequence

import numpy as np

from .bake_scene import LightGroup, LightmapPage
from .errors import UsageError
from .relighting import KeptBake, relight
from .settings import GroupSetting
from .solver.arrays import Array

OTHERS = "others"
"""The group of what is in none."""


def group_pages(
    kept: KeptBake, pages: tuple[LightmapPage, ...]
) -> Generator[float, None, tuple[LightGroup, ...]]:
    """Compute the lightmaps of each of the settings' light groups; yields the fraction done.

    They sum to the whole: what sweeps that end, clamps at 0 and stitching leave of it, a small
    part, is shared out over the groups in proportion.

    Parameters
    ----------
    pages : tuple of LightmapPage
        Those of all light together.
    """
    chosen = members(kept.settings.groups, kept.names, kept.strengths)
    found = []
    for number, (_, rows) in enumerate(chosen):
        steps = relight(kept, kept.strengths * rows[:, None])
        while True:
            try:
                fraction = next(steps).fraction
            except StopIteration as done:
                found.append(done.value)
                break
            yield (number + fraction) / len(chosen)
    pixels = [
        shared_out(page.pixels, np.stack([of[number].pixels for of in found]))
        for number, page in enumerate(pages)
    ]
    return tuple(
        LightGroup(
            name,
            tuple(LightmapPage(part[group], page.coverage) for part, page in zip(pixels, pages, strict=True)),
        )
        for group, (name, _) in enumerate(chosen)
    )


def shared_out(whole: Array, parts: Array) -> Array:
    """Scale (g, …) parts so that they sum to the `whole` (…), none below 0; float32.

    Where no part has anything, the largest of them over all takes what there is.
    """
    parts = np.maximum(parts.astype(np.float64), 0.0)
    total = parts.sum(axis=0)
    result = np.asarray(parts * np.where(total > 0, whole / np.where(total > 0, total, 1.0), 0.0))
    largest = int(parts.reshape(len(parts), -1).sum(axis=1).argmax())
    result[largest] += np.where(total > 0, 0.0, whole)
    return np.asarray(result, dtype=np.float32)


def members(
    groups: Sequence[GroupSetting], names: Sequence[str], strengths: Array
) -> list[tuple[str, Array]]:
    """Tell which sources are in which group.

    Parameters
    ----------
    names : sequence of str
        The sources'.
    strengths : (s, 3) float64
        Theirs: what is in no group is gathered in `OTHERS`, if it shines.

    Returns
    -------
    members : list of (str, (s,) bool)

    Raises
    ------
    UsageError
        If a member is no source.
    """
    known = np.array(names, dtype=object)
    found = []
    for name, wanted in groups:
        for member in wanted:
            if member not in names:
                raise UsageError(
                    f"light group '{name}': there is no lamp, emissive material or world '{member}'"
                )
        found.append((name, np.isin(known, np.array(wanted, dtype=object))))
    left = ~np.any([rows for _, rows in found], axis=0) if found else np.ones(len(known), dtype=bool)
    if (left & strengths.any(axis=1)).any():
        found.append((OTHERS, left))
    return found
