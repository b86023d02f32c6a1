"""Whether a bake could write its files, asked before it runs."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from ...options import BakeSettings
from ..images.images import names_of_any
from ..scene_records.pieces import Piece, SceneContents
from .output import OutputFolder


def file_refusal(
    output: OutputFolder,
    settings: BakeSettings,
    collected: SceneContents,
    chosen: Sequence[Piece],
    more: Collection[str] = (),
) -> str | None:
    """Return why a bake would stop because of a file it must not replace, if it would; changes no file.

    output: Not entered.
    chosen: What gets lightmaps.
    more collection of str: Names of what is written besides lightmaps and the report.
    """
    objects = [piece.source.name for piece in chosen]
    groups = _light_groups(collected)
    wanted = settings.groups or (settings.light_groups and any(groups))
    names = names_of_any(output.names, settings, objects, groups if wanted else None, output.path)
    return output.refusal([*more, *names])


def _light_groups(collected: SceneContents) -> list[str]:
    """Return the light groups of all sources, "" for none."""
    on_material = [getattr(material, "group", "") for material in collected.materials]
    of_surfaces = [
        piece.groups.of_group(on_material[row])
        for piece in collected.pieces
        for row in np.unique(piece.surface)
    ]
    return [*collected.groups, *of_surfaces]
