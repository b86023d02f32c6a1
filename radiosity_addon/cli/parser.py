"""The command line's words as a request: one parser for `python -m`, Blender's `--command` and build.py.

Parsing needs neither Blender nor NumPy.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NoReturn

from ..base import UsageError
from ..files import checked_folder, checked_name, checked_path
from ..options import (
    ATLASES,
    FORMATS,
    LIGHTS,
    METHODS,
    QUALITIES,
    QUANTITIES,
    SETTINGS,
    BakeSettings,
    GroupSetting,
)

SHARED_FIELDS = (
    *("texel_density", "pages", "max_resolution", "mip_levels", "padding", "unwrap_seconds"),
    *("atlas", "quality", "relative_error", "quantity", "light", "format"),
    *("sky", "keep_uvs", "light_groups", "seed", "threads", "method", *SETTINGS),
)
"""Settings whose option says exactly what the field says."""

BUNDLED_OUTPUT = Path("out/cornell")
"""Where the bundled scene goes when no --output is given."""


def build_parser(prog: str) -> argparse.ArgumentParser:
    """Return the parser of both verbs; it raises `UsageError` where argparse would exit."""
    parser = _Parser(prog=prog, description="Bake radiosity lightmaps.", allow_abbrev=False)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="{bake,restore}")
    _add_bake(verbs.add_parser("bake", help="bake lightmaps", allow_abbrev=False))
    _add_restore(verbs.add_parser("restore", help="take the lightmaps out again", allow_abbrev=False))
    return parser


def requested_settings(request: argparse.Namespace) -> BakeSettings:
    """Return the validated settings of a parsed `bake`."""
    given: dict[str, Any] = {name: getattr(request, name) for name in SHARED_FIELDS}
    if request.resolution is not None:
        given["resolution"] = request.resolution
    for name in ("objects", "light_only", "ignore"):
        if getattr(request, name) is not None:
            given[name] = tuple(getattr(request, name))
    given["groups"] = tuple(map(light_group, request.groups or ()))
    return BakeSettings(**given)


def light_group(text: str) -> GroupSetting:
    """Read a light group as the command line has it: NAME=MEMBER,MEMBER…

    Raises
    ------
    UsageError
        If it is not of this form.
    """
    name, _, members = text.partition("=")
    wanted = tuple(filter(None, (member.strip() for member in members.split(","))))
    if not name.strip() or not wanted:
        raise UsageError(
            f"--light-group {text}: give a name and what is in it, such as Kitchen=Lamp,Stove,World"
        )
    return name.strip(), wanted


def bake_output(request: argparse.Namespace, loaded: Path | None) -> Path:
    """Return where the bake goes: a scene needs --output, the bundled one has a default."""
    given: Path | None = request.output
    if given is not None:
        return given
    if request.scene is not None or loaded is not None:
        raise UsageError("bake needs --output DIR, the folder everything is written to")
    return BUNDLED_OUTPUT


def check_keeping(request: argparse.Namespace, settings: BakeSettings) -> None:
    """Refuse to keep what cannot be lit anew, and to relight otherwise than it was baked."""
    if request.keep and settings.method != "hierarchical":
        raise UsageError(f"--keep needs the hierarchical method; {settings.method} keeps no links")
    if request.keep and settings.quantity == "residual":
        raise UsageError("--keep: a residual is of all light together; bake another quantity")
    if request.relight and request.plot is not None:
        raise UsageError("--relight solves nothing whose history --plot could draw")


def check_plot(plot: Path | None) -> None:
    """Refuse to draw the history into a file of another kind."""
    if plot is not None and plot.suffix.lower() != ".png":
        raise UsageError(f"--plot {plot} is not a .png file")


class _Parser(argparse.ArgumentParser):
    """An ArgumentParser whose errors are ours: one line, no exit."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (see {self.prog} --help)")


def _add_bake(parser: argparse.ArgumentParser) -> None:
    default = BakeSettings()
    add = parser.add_argument
    add(
        "scene",
        nargs="?",
        type=checked_path,
        metavar="SCENE",
        help=".blend, .glb, .gltf or .obj; without it the file Blender has open, or the bundled Cornell box",
    )
    add(
        "--output",
        type=checked_folder,
        metavar="DIR",
        help=f"where everything goes (default for the bundled scene: {BUNDLED_OUTPUT})",
    )
    size = parser.add_mutually_exclusive_group()
    size.add_argument(
        "--resolution",
        type=int,
        metavar="N",
        help=f"width and height of an atlas page in pixels (default {default.resolution})",
    )
    size.add_argument(
        "--texel-density",
        type=float,
        metavar="PX_PER_M",
        help="pixels per metre; the page size follows from the surface",
    )
    add("--pages", type=int, default=default.pages, metavar="N", help="shared images (default 1)")
    add(
        "--max-resolution",
        type=int,
        default=default.max_resolution,
        metavar="N",
        help=f"largest page that a density makes; more need more pages (default {default.max_resolution})",
    )
    between = parser.add_mutually_exclusive_group()
    between.add_argument(
        "--mip-levels",
        type=int,
        default=default.mip_levels,
        metavar="N",
        help="down to which mip level charts stay apart (default 0)",
    )
    between.add_argument("--padding", type=int, metavar="N", help="free texels between charts instead")
    add(
        "--unwrap-seconds",
        type=float,
        default=default.unwrap_seconds,
        metavar="S",
        help=f"longest time to unwrap one object well (default {default.unwrap_seconds:g})",
    )
    accuracy = parser.add_mutually_exclusive_group()
    accuracy.add_argument(
        "--quality",
        choices=QUALITIES,
        default=default.quality,
        help=f"how fine the solution is (default {default.quality})",
    )
    accuracy.add_argument(
        "--error",
        type=float,
        dest="relative_error",
        metavar="E",
        help="the error to reach instead, such as 0.02: RMS, relative to the mean of the light",
    )
    for name, choices, text in (
        ("atlas", ATLASES, "one image for all objects, or one for each"),
        ("quantity", QUANTITIES, "what a texel holds"),
        ("light", LIGHTS, "which light is baked"),
        ("format", FORMATS, "kind of image file"),
    ):
        chosen = getattr(default, name)
        add(f"--{name}", choices=choices, default=chosen, help=f"{text} (default {chosen})")
    add(
        "--objects",
        nargs="+",
        type=checked_name,
        metavar="NAME",
        help="what gets a lightmap; the rest still lights and blocks (default: every rendered mesh)",
    )
    add(
        "--light-only",
        nargs="+",
        type=checked_name,
        metavar="NAME",
        help="what lights and blocks but gets no lightmap",
    )
    add(
        "--ignore",
        nargs="+",
        type=checked_name,
        metavar="NAME",
        help="what is left out as if it were not there",
    )
    add(
        "--sky", action="store_true", help="add a white sky of strength 1 where the scene has no light at all"
    )
    add("--keep-uvs", action="store_true", help="use an existing UV layer Lightmap as it is")
    add("--light-groups", action="store_true", help="a lightmap also for each light group of the scene")
    add(
        "--light-group",
        dest="groups",
        action="append",
        type=checked_name,
        metavar="NAME=MEMBER,…",
        help="a lightmap also for these lamps, emissive materials or the world (may be repeated)",
    )
    add("--seed", type=int, default=default.seed, metavar="N", help="random seed (default 0)")
    add("--threads", type=int, default=default.threads, metavar="N", help="threads (default: all cores)")
    add("--check", action="store_true", help="bake nothing; say what would be baked, and what is odd")
    keeping = parser.add_mutually_exclusive_group()
    keeping.add_argument(
        "--keep", action="store_true", help="also write a sidecar, by which --relight lights the bake anew"
    )
    keeping.add_argument(
        "--relight",
        action="store_true",
        help="light the bake in DIR anew, by other strengths of its lights, with the settings that it has",
    )
    _add_common(parser)
    add("--no-preview", action="store_true", help="write no preview.png; an earlier one stays")
    add("--report", type=checked_path, metavar="FILE", help="second copy of report.json")
    add(
        "--plot",
        type=checked_path,
        metavar="FILE.png",
        help="draw the history of residual, elements and links",
    )
    _add_method(parser)


def _add_method(parser: argparse.ArgumentParser) -> None:
    """Add the method, and an option for each setting that some methods have."""
    group = parser.add_argument_group("method", "Settings not given come from the quality.")
    chosen = BakeSettings().method
    group.add_argument(
        "--method",
        choices=tuple(METHODS),
        default=chosen,
        help=f"how the radiosity equation is solved (default {chosen})",
    )
    for name, setting in SETTINGS.items():
        of = [method for method in METHODS if name in METHODS[method].settings]
        what = setting.description
        what = what[0].lower() + what[1:] if what[1].islower() else what
        text = f"{what} (for {', '.join(of) if len(of) < len(METHODS) else 'all methods'})"
        if setting.kind is bool:
            group.add_argument(setting.option, dest=name, action="store_const", const=True, help=text)
        else:
            # Choices are checked with the rest of the settings.
            metavar = setting.metavar or "{" + ",".join(setting.choices) + "}"
            group.add_argument(setting.option, dest=name, type=setting.kind, metavar=metavar, help=text)


def _add_restore(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scene",
        nargs="?",
        type=checked_path,
        metavar="SCENE",
        help="a baked .blend; without it the file Blender has open",
    )
    parser.add_argument(
        "--output", type=checked_path, required=True, metavar="FILE", help="the restored .blend to write"
    )
    _add_common(parser)


def _add_common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quiet", action="store_true", help="print errors only")
    parser.add_argument(
        "--overwrite",
        action="store_true",
        help="replace files that no bake of this scene has written; never those the scene reads",
    )
    parser.add_argument(
        "--allow-scripts", action="store_true", help="run the scripts and drivers of the .blend"
    )
