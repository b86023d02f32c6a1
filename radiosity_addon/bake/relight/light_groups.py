"""Light groups: named sets of a scene's sources of light, each with lightmaps of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base import SILENT, Progress, UsageError
from ...lightmap.images import LightmapPage
from ...numerics import Array, tiles
from ...options import MAX_GROUPS, OTHERS, BakeSettings
from ...scene import BakeScene
from ..result import LightGroup
from .kept_bake import KeptBake, relight_pages

BAND = 64
"""Rows of a page that are shared out at once."""


def are_wanted(bake_scene: BakeScene, settings: BakeSettings) -> bool:
    """Return whether a bake makes lightmaps of light groups."""
    known = any((*bake_scene.light_groups, *bake_scene.emitter_groups))
    return bool(settings.groups) or (settings.light_groups and known)


def group_of(name: str, of_scene: str, settings: BakeSettings) -> str:
    """Return the group of a source, `OTHERS` if it is in none.

    name: The source's.
    of_scene: The group that the scene puts it in, or "".
    """
    for group, wanted in settings.groups:
        if name in wanted:
            return group
    return (of_scene if settings.light_groups else "") or OTHERS


def check_groups(bake_scene: BakeScene, settings: BakeSettings) -> None:
    """Refuse before the work what light groups cannot be.

    Raises UsageError if a member is no source, or there are too many groups.
    """
    lights, emitters = bake_scene.scene.lights, bake_scene.emitter_names
    names = (*(light.name for light in lights), *emitters)
    if bake_scene.emitter is not None:
        _check_members(settings, names)
    given = (
        *(bake_scene.light_groups or ("",) * len(lights)),
        *(bake_scene.emitter_groups or ("",) * len(emitters)),
    )
    found = {group_of(name, own, settings) for name, own in zip(names, given, strict=True)}
    if len(found) > MAX_GROUPS:
        raise UsageError(
            f"{len(found)} light groups are more than the {MAX_GROUPS} that materials can mix: merge some"
        )


def _check_members(settings: BakeSettings, names: Sequence[str]) -> None:
    for name, wanted in settings.groups:
        for member in wanted:
            if member not in names:
                raise UsageError(
                    f"light group '{name}': there is no lamp, emissive material or world '{member}'"
                )


def group_pages(
    kept: KeptBake,
    pages: tuple[LightmapPage, ...],
    strengths: Array | None = None,
    progress: Progress = SILENT,
) -> tuple[LightGroup, ...]:
    """Compute the lightmaps of each of the light groups.

    They sum to the whole: what sweeps that end, clamps at 0 and stitching leave of it, a small
    part, is shared out over the groups in proportion.

    pages: Those of all light together.
    strengths (s, 3): The sources', with which `pages` were lit; None for those of the bake.
    """
    given = kept.strengths if strengths is None else kept.sources.checked(strengths)
    chosen = members(kept.settings, kept.names, kept.groups, given)
    found = [relight_pages(kept, given * rows[:, None], part) for (_, rows), part in progress.each(chosen)]
    for number, page in enumerate(pages):
        share_out(page.pixels, [of[number].pixels for of in found])
    return tuple(
        LightGroup(
            name,
            found[group],
            tuple(dict.fromkeys(np.array(kept.names, dtype=object)[rows])),
        )
        for group, (name, rows) in enumerate(chosen)
    )


def share_out(whole: Array, parts: Sequence[Array]) -> None:
    """Scale parts of an image where they are, so that they sum to the `whole` (height, …), none below 0.

    Where no part has anything, the largest of them over all takes what there is.
    """
    light = np.zeros(len(parts))
    for rows in tiles(len(whole), BAND):
        light += [np.maximum(part[rows], 0.0).sum(dtype=np.float64) for part in parts]
    largest = int(light.argmax())
    for rows in tiles(len(whole), BAND):
        shares = np.maximum(np.stack([part[rows] for part in parts]).astype(np.float64), 0.0)
        total = shares.sum(axis=0)
        shares *= np.where(total > 0, whole[rows] / np.where(total > 0, total, 1.0), 0.0)
        shares[largest] += np.where(total > 0, 0.0, whole[rows])
        for part, share in zip(parts, shares, strict=True):
            part[rows] = share


def members(
    settings: BakeSettings, names: Sequence[str], of_scene: Sequence[str], strengths: Array
) -> list[tuple[str, Array]]:
    """Return which sources are in which group.

    names, of_scene: The s sources' names, and the groups that the scene puts them in.
    strengths (s, 3): Theirs: `OTHERS` is there only if it was requested, or something in it shines.
    Returns members list of (str, (s,) bool): The settings' groups in their order, then the scene's by name,
        `OTHERS` last.
    Raises UsageError if a member is no source.
    """
    _check_members(settings, names)
    groups = [group_of(name, own, settings) for name, own in zip(names, of_scene, strict=True)]
    label = np.array(groups, dtype=object)
    chosen = [name for name, _ in settings.groups]
    rest = sorted(set(label) - {*chosen, OTHERS})
    found = [(name, label == name) for name in (*chosen, *rest)]
    left = label == OTHERS
    if OTHERS not in chosen and (left & strengths.any(axis=1)).any():
        found.append((OTHERS, left))
    return found
