"""Options that only the command line has."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..options import FORM_NAMES, SUM_GROUPS, option, options_of

SECTION = "Command"


@dataclass(frozen=True)
class _BakeCommand:
    """Options of `bake` on the command line alone."""

    output: Path | None = option(
        None,
        "Folder that everything is written to; for the bundled scene out/cornell if it is not given",
        SECTION,
        metavar="DIR",
    )
    keep: bool = option(
        False, "Also write a sidecar, lightmap.relight, by which --relight updates the bake", SECTION
    )
    relight: bool = option(
        False,
        "Update the bake in DIR for changed light colors and strengths, by its sidecar and with its own "
        "settings, without tracing rays",
        SECTION,
        instead_of="keep",
    )
    spool: Path | None = option(
        None,
        "Share the bake with workers through this folder, which must be empty or of a bake that did not end; "
        "see the guide's page on several machines",
        SECTION,
        metavar="DIR",
    )
    farm: str | None = option(
        None,
        "Start workers that share the bake: local:N starts N on this machine, through a folder next to DIR "
        "that the bake makes and removes without --spool; tls://HOST:PORT starts them on a Dask cluster",
        SECTION,
        metavar="SPEC",
    )
    check: bool = option(
        False,
        "Bake nothing: show what would be baked, and problems of the scene; the exit code is 1 if a bake "
        "would stop",
        SECTION,
    )
    export: str | None = option(
        None,
        f"Also export into DIR/export, in one or more of these forms, separated by commas: {FORM_NAMES}. "
        "Charts get 4 free pixels between them unless --padding or --mip-levels is given",
        SECTION,
        metavar="FORM,…",
    )
    no_preview: bool = option(False, "Write no preview.png; that of an earlier bake stays", SECTION)
    report: Path | None = option(None, "Second copy of report.json", SECTION, metavar="FILE")
    plot: Path | None = option(
        None,
        "Draw the history of residual, elements and links, against seconds and iterations",
        SECTION,
        metavar="FILE.svg",
    )


@dataclass(frozen=True)
class _ExportCommand:
    """Options of `export` on the command line."""

    forms: str = option(
        "web",
        f"What to write, separated by commas: {FORM_NAMES}",
        SECTION,
        metavar="FORM,…",
    )


@dataclass(frozen=True)
class _EveryExport:
    """Options of `export`, and of `bake` with `--export`."""

    sum_groups: bool = option(False, SUM_GROUPS, SECTION)


@dataclass(frozen=True)
class _EveryCommand:
    """Options of every command."""

    quiet: bool = option(False, "Print errors only", SECTION)
    overwrite: bool = option(
        False,
        "Replace files that no bake of this scene has written, but never those that the scene reads",
        SECTION,
    )
    allow_scripts: bool = option(False, "Run the scripts and drivers of the .blend", SECTION)


BAKE_COMMAND = options_of(_BakeCommand)
"""Options of the command `bake` by their name in the parsed request."""

PREPARED_OPTIONS = ("keep", "export", "no_preview")
"""Those of them that `prepare` takes, …"""

FINISH_OPTIONS = ("output", "report", "plot")
"""… and `finish`: what says which files may be written is asked for where they are written."""

EXPORT_COMMAND = options_of(_ExportCommand)
"""Options of the command `export`."""

EVERY_EXPORT = options_of(_EveryExport)
"""Options of both commands that export."""

EVERY_COMMAND = options_of(_EveryCommand)
"""Options of all commands."""
