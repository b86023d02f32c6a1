"""The table of the panel's own options: what scripts and the command line give in other ways, or need not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .choices import EXPORT_FORMS, LOOKS, SCOPES, SIZE_MODES
from .export_forms import SUM_GROUPS
from .option_record import PanelRow, option, options_of
from .sections import EXPORT, FILES, LAST_BAKE, OBJECTS, RELIGHTING, VIEWPORT

RELIGHT_GROUP = "radiosity_relight"
"""The group of properties that files have the options of relighting in."""


def _form(name: str, default: bool = False) -> Any:
    """Return the check box of a form of an export."""
    choice = next(choice for choice in EXPORT_FORMS if choice.value == name)
    return option(default, choice.description, EXPORT, panel=PanelRow(choice.label))


@dataclass(init=False, repr=False, eq=False)
class _PanelSettings:
    """Options of the panel alone."""

    scope: str = option(
        "all",
        "Which objects get a lightmap; all others still light and block",
        OBJECTS,
        choices=SCOPES,
        panel=PanelRow("Objects", expand=True),
    )
    size_mode: str = option(
        "resolution",
        "How the size of the lightmaps is chosen",
        "Size",
        choices=SIZE_MODES,
        preset=True,
        panel=PanelRow("Size", expand=True),
    )
    output_folder: str = option(
        "//lightmaps/",
        "Where the lightmaps are written. A folder that begins with // is next to the file; while that file "
        "is not saved, lightmaps are packed into it",
        FILES,
        panel=PanelRow("Folder", subtype="DIR_PATH"),
    )
    keep: bool = option(
        True,
        "Keep in memory how light travels, so that Relight can apply other strengths and colors of lamps, "
        "emission and world. Takes about 300 bytes for each pixel that shows a surface: 60 MB at 512 × 512, "
        "1 GB at 2048 × 2048. Bakes of many lamps take somewhat longer",
        RELIGHTING,
        panel=PanelRow("Keep for Relighting", group=RELIGHT_GROUP),
    )
    sidecar: bool = option(
        False,
        "Also write this data to a file next to the lightmaps, so that the bake can be relit after the scene "
        "was closed. About half as large as in memory",
        RELIGHTING,
        panel=PanelRow("Write Sidecar", group=RELIGHT_GROUP),
    )
    only_moved: bool = option(
        True,
        "If objects have only moved since a bake that is still in memory, bake only what they affect: the "
        "same light in less than half of the time. The layout of the lightmaps stays",
        RELIGHTING,
        panel=PanelRow("Incremental Moves", group=RELIGHT_GROUP),
    )
    show_while_solving: bool = option(
        True,
        "Draw the light over the objects in the viewports while a bake runs: the elements while it solves, "
        "then the texels",
        VIEWPORT,
        panel=PanelRow("Show While Solving"),
    )
    show_result: bool = option(
        True,
        "Switch the viewport from solid to material preview when the bake is done",
        VIEWPORT,
        panel=PanelRow("Show Result"),
    )
    show: str = option(
        "shine",
        "How baked objects look in material preview and in renders",
        LAST_BAKE,
        choices=LOOKS,
        panel=PanelRow("Show", expand=True),
    )
    export_web: bool = _form("web", True)
    export_glb: bool = _form("glb")
    export_godot: bool = _form("godot")
    export_unity: bool = _form("unity")
    export_bevy: bool = _form("bevy")
    export_rgbm: bool = _form("rgbm")
    sum_groups: bool = option(False, SUM_GROUPS, EXPORT, panel=PanelRow("Sum Light Groups"))


PANEL_OPTIONS = options_of(_PanelSettings)
"""Every option that only the panel has, by its name."""
