"""lightmaps.json: which node has which part of which lightmap, and in what unit; for engines' importers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

INDEX_NAME = "lightmaps.json"
INDEX_VERSION = 1
"""Grows when a reader of the one before would go wrong; new keys alone do not change it."""

QUANTITY = "irradiance_over_pi"
UNIT = "W/m²/sr"


@dataclass(frozen=True)
class PageEntry:
    """One lightmap in its encodings: files of the same image.

    rgbm, rgbm_range: Only if that was exported.
    """

    width: int
    height: int
    exr: str
    ktx2: str
    rgbm: str | None = None
    rgbm_range: float | None = None


@dataclass(frozen=True)
class NodeEntry:
    """Where a node's lightmap is: UV of the page = UV of set `texCoord` · scale + offset, v up."""

    node: str
    page: int
    texCoord: int = 1  # noqa: N815 - as glTF spells it
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class GroupEntry:
    """The lightmaps of one light group, as baked: pages are the sum of all groups, each times its factor."""

    name: str
    factor: tuple[float, float, float]
    pages: tuple[PageEntry, ...]


@dataclass(frozen=True)
class ViewSettings:
    """How the scene's renders are shown.

    transform, look: Blender's names, such as `AgX` and `None`.
    exposure: Stops.
    """

    transform: str = "Standard"
    look: str = "None"
    exposure: float = 0.0
    gamma: float = 1.0


@dataclass(frozen=True)
class LightmapIndex:
    """What lightmaps.json says.

    light: `all`, `direct` or `indirect`.
    baked_lights: Names of the lamps that are in the lightmap, and must not light its objects again.
    """

    light: str
    pages: Sequence[PageEntry]
    nodes: Sequence[NodeEntry]
    light_groups: Sequence[GroupEntry] = ()
    baked_lights: Sequence[str] = ()
    lumens_per_watt: float = 683.0
    notes: Sequence[str] = field(default_factory=tuple)
    view: ViewSettings = ViewSettings()


def lightmap_index(index: LightmapIndex) -> str:
    """Return the text of the file."""
    encodings = {
        "exr": "OpenEXR, half float, linear Rec. 709, the quantity itself",
        "ktx2": "KTX2, E5B9G9R9_UFLOAT_PACK32, linear Rec. 709, the quantity itself; rows from the top",
    }
    if any(page.rgbm for page in index.pages):
        encodings["rgbm"] = "PNG, linear Rec. 709: the quantity = rgbm_range · alpha · color, each of 0 to 1"
    head = {"version": INDEX_VERSION, "quantity": QUANTITY, "unit": UNIT, "encodings": encodings}
    content = asdict(index, dict_factory=_without_none)
    return json.dumps({**head, **content}, indent=1, ensure_ascii=False) + "\n"


def _without_none(items: list[tuple[str, Any]]) -> dict[str, Any]:
    return {key: value for key, value in items if value is not None}
