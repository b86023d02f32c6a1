"""How options are grouped, in the help, on the options' page and in the panel."""

from __future__ import annotations

MAIN, ADVANCED, GROUPS, SOLVER = "Radiosity Lightmaps", "Advanced", "Light Groups", "Solver"
LAST_BAKE = "Last Bake"
EXPORT = "Export"
"""Parts of the panel."""

OBJECTS, FILES, RELIGHTING, VIEWPORT = "Objects", "Files", "Relighting", "Viewport"
"""Sections that only the panel has options in."""

SECTIONS = {
    OBJECTS: MAIN,
    "Size": MAIN,
    "Quality": MAIN,
    "Pages": MAIN,
    FILES: MAIN,
    "Image": ADVANCED,
    "Layout": ADVANCED,
    "Scene": ADVANCED,
    "Computation": ADVANCED,
    RELIGHTING: ADVANCED,
    VIEWPORT: ADVANCED,
    "Light Groups": GROUPS,
    "Solver": SOLVER,
    LAST_BAKE: LAST_BAKE,
    EXPORT: EXPORT,
}
"""Every section of the tables, in order, with the part of the panel that shows it."""


def sections_of(part: str) -> tuple[str, ...]:
    """Return the sections that a part of the panel shows."""
    return tuple(section for section, shown_in in SECTIONS.items() if shown_in == part)
