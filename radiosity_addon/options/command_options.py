"""Options of the command line alone: what a command does besides the bake."""

from __future__ import annotations

from pathlib import Path

from .option import Option, named

SECTION = "Command"


def _options(*found: tuple[str, type, Option]) -> dict[str, Option]:
    return {name: named(option, name, kind) for name, kind, option in found}


BAKE_COMMAND = _options(
    (
        "output",
        Path,
        Option(
            "Folder that everything is written to; for the bundled scene out/cornell if it is not given",
            SECTION,
            metavar="DIR",
        ),
    ),
    (
        "keep",
        bool,
        Option("Also write a sidecar, lightmap.relight, by which --relight updates the bake", SECTION),
    ),
    (
        "relight",
        bool,
        Option(
            "Update the bake in DIR for changed light colors and strengths, by its sidecar and with its own "
            "settings, without tracing rays",
            SECTION,
            instead_of="keep",
        ),
    ),
    (
        "check",
        bool,
        Option(
            "Bake nothing: show what would be baked, and problems of the scene; the exit code is 1 if a bake "
            "would stop",
            SECTION,
        ),
    ),
    (
        "no_preview",
        bool,
        Option("Write no preview.png; that of an earlier bake stays", SECTION),
    ),
    ("report", Path, Option("Second copy of report.json", SECTION, metavar="FILE")),
    (
        "plot",
        Path,
        Option(
            "Draw the history of residual, elements and links, against seconds and iterations",
            SECTION,
            metavar="FILE.png",
        ),
    ),
)
"""Options of the verb `bake` by their name in the parsed request."""

EVERY_COMMAND = _options(
    ("quiet", bool, Option("Print errors only", SECTION)),
    (
        "overwrite",
        bool,
        Option(
            "Replace files that no bake of this scene has written, but never those that the scene reads",
            SECTION,
        ),
    ),
    ("allow_scripts", bool, Option("Run the scripts and drivers of the .blend", SECTION)),
)
"""Options of both verbs."""
