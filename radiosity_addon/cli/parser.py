"""The command line's parser, shared by `python -m`, Blender's `--command` and build.py.

Parsing needs neither Blender nor NumPy.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NoReturn

from ..base import UsageError
from ..options import METHODS, OPTIONS, SECTIONS, BakeSettings, GroupSetting, Option, plain
from .command_options import (
    BAKE_COMMAND,
    EVERY_COMMAND,
    EVERY_EXPORT,
    EXPORT_COMMAND,
    FINISH_OPTIONS,
    PREPARED_OPTIONS,
)
from .farm_spec import read_farm_spec
from .path_checks import checked_folder, checked_name, checked_path

SCENE_SUFFIXES = (".blend", ".glb", ".gltf", ".obj")
"""How names of scenes end that can be opened."""

BUNDLED_OUTPUT = Path("out/cornell")
"""Where the bundled scene goes when no --output is given."""


def build_parser(prog: str) -> argparse.ArgumentParser:
    """Return the parser of all commands; it raises `UsageError` where argparse would exit."""
    parser = _Parser(prog=prog, description="Bake radiosity lightmaps.", allow_abbrev=False)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="COMMAND")
    _add_bake(verbs.add_parser("bake", help="bake lightmaps", allow_abbrev=False))
    _add_prepare(verbs.add_parser("prepare", help="store a bake to run without Blender", allow_abbrev=False))
    _add_finish(verbs.add_parser("finish", help="show and write what such a bake found", allow_abbrev=False))
    _add_flip(verbs.add_parser("flip", help="flip faces that show their backs", allow_abbrev=False))
    _add_export(verbs.add_parser("export", help="export a bake for engines", allow_abbrev=False))
    _add_restore(verbs.add_parser("restore", help="take the lightmaps out again", allow_abbrev=False))
    return parser


def requested_settings(request: argparse.Namespace) -> BakeSettings:
    """Return the validated settings of a parsed `bake`: what was not given has its default."""
    given = {name: value for name, value in vars(request).items() if name in OPTIONS}
    for name, value in given.items():
        if OPTIONS[name].kind is tuple:
            given[name] = tuple(map(light_group, value)) if OPTIONS[name].repeated else tuple(value)
    return BakeSettings(**given)


def given_options(request: argparse.Namespace) -> list[str]:
    """Return the names of the settings that a parsed command gives, be it with their defaults."""
    return [name for name in OPTIONS if name in vars(request)]


def light_group(text: str) -> GroupSetting:
    """Read a light group as the command line has it: NAME=MEMBER,MEMBER…

    Raises UsageError if it is not of this form.
    """
    name, _, members = text.partition("=")
    wanted = tuple(filter(None, (member.strip() for member in members.split(","))))
    if not name.strip() or not wanted:
        raise UsageError(
            f"--light-group {text}: give a name and what is in it, such as Kitchen=Lamp,Stove,World"
        )
    return name.strip(), wanted


def bake_output(request: argparse.Namespace, loaded: Path | None) -> Path:
    """Return where a bake goes: a scene needs --output, the bundled one has a default."""
    given: Path | None = request.output
    if given is not None:
        return given
    if request.scene is not None or loaded is not None:
        raise UsageError(f"{request.verb} needs --output DIR, the folder everything is written to")
    return BUNDLED_OUTPUT


def check_keeping(request: argparse.Namespace, settings: BakeSettings) -> None:
    """Refuse to keep bakes that cannot be relit, and to relight with settings other than the bake's."""
    if request.keep and settings.method != "hierarchical":
        raise UsageError(f"--keep needs the hierarchical method; {settings.method} keeps no links")
    if request.keep and settings.quantity == "residual":
        raise UsageError("--keep: a residual is of all light together; bake another quantity")
    if request.relight and request.plot is not None:
        raise UsageError("--relight solves nothing, so --plot has no history to draw")
    if request.relight and request.check:
        raise UsageError("--check looks at a bake, not at --relight: give one of the two")


def check_scene(request: argparse.Namespace, loaded: Path | None) -> None:
    """Refuse a scene that was given where only names of objects can be."""
    names = getattr(request, "objects", ())
    if request.scene is None and loaded is None and names and names[-1].lower().endswith(SCENE_SUFFIXES):
        raise UsageError(f"--objects takes all names after it, and so '{names[-1]}': give SCENE before it")


def check_sharing(request: argparse.Namespace) -> None:
    """Read who is to help, as a `FarmSpec` or None, and refuse to share what traces no rays."""
    for flag, given in (("--relight", request.relight), ("--check", request.check)):
        for option in ("spool", "farm"):
            if given and getattr(request, option) is not None:
                raise UsageError(f"{flag} traces no rays, so there is nothing to share: leave --{option} out")
    if request.farm is not None:
        request.farm = read_farm_spec(request.farm)
        if request.farm.scheduler and request.spool is None:
            raise UsageError(
                f"--farm {request.farm.scheduler} needs --spool DIR, a folder that all machines share"
            )


def check_plot(plot: Path | None) -> None:
    """Refuse to draw the history into a file of another kind."""
    if plot is not None and plot.suffix.lower() != ".svg":
        raise UsageError(f"--plot {plot}: the plot is an SVG picture; choose a name that ends in .svg")


def check_blend(output: Path) -> None:
    """Refuse to write a scene into a file of another kind, such as the lightmap that it reads."""
    if output.suffix.lower() != ".blend":
        raise UsageError(f"--output {output}: a .blend is written; choose a name that ends in .blend")


class _Parser(argparse.ArgumentParser):
    """An ArgumentParser whose errors are ours: one line, no exit."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (see {self.prog} --help)")


def _add_bake(parser: argparse.ArgumentParser) -> None:
    _add_scene(parser)
    _add_options(parser, (*BAKE_COMMAND.values(), *EVERY_EXPORT.values(), *EVERY_COMMAND.values()))
    _add_settings(parser)


def _add_prepare(parser: argparse.ArgumentParser) -> None:
    _add_scene(parser)
    _add_spool(parser, "the folder that the bake is prepared in, empty or new")
    of_bake = (BAKE_COMMAND[name] for name in PREPARED_OPTIONS)
    of_all = (option for name, option in EVERY_COMMAND.items() if name != "overwrite")
    _add_options(parser, (*of_bake, *EVERY_EXPORT.values(), *of_all))
    _add_settings(parser)
    parser.set_defaults(check=False, relight=False, plot=None, farm=None, overwrite=False)


def _add_finish(parser: argparse.ArgumentParser) -> None:
    _add_scene(parser)
    _add_spool(parser, "the folder that the bake was prepared and run in")
    of_bake = (BAKE_COMMAND[name] for name in FINISH_OPTIONS)
    _add_options(parser, (*of_bake, *EVERY_COMMAND.values()))


def _add_scene(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scene",
        nargs="?",
        type=checked_path,
        metavar="SCENE",
        help=".blend, .glb, .gltf or .obj; without it the file Blender has open, or the bundled Cornell box",
    )


def _add_spool(parser: argparse.ArgumentParser, text: str) -> None:
    parser.add_argument("--spool", type=checked_folder, required=True, metavar="DIR", help=text)


def _add_settings(parser: argparse.ArgumentParser) -> None:
    for section in SECTIONS:
        options = [option for option in OPTIONS.values() if option.section == section]
        if options:
            _add_options(parser.add_argument_group(section), options)


def _add_export(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=checked_folder, metavar="DIR", help="the folder that was baked into")
    _add_options(parser, (*EXPORT_COMMAND.values(), *EVERY_EXPORT.values(), *EVERY_COMMAND.values()))
    parser.set_defaults(forms=EXPORT_COMMAND["forms"].default)


def _add_flip(parser: argparse.ArgumentParser) -> None:
    _add_file_to_file(parser, ".blend, .glb, .gltf or .obj", "the .blend to write, with these faces flipped")


def _add_restore(parser: argparse.ArgumentParser) -> None:
    _add_file_to_file(parser, "a baked .blend", "the restored .blend to write")


def _add_file_to_file(parser: argparse.ArgumentParser, scene: str, output: str) -> None:
    """Add what makes another file of a scene."""
    parser.add_argument(
        "scene",
        nargs="?",
        type=checked_path,
        metavar="SCENE",
        help=f"{scene}; without it the file Blender has open",
    )
    parser.add_argument("--output", type=checked_path, required=True, metavar="FILE", help=output)
    _add_options(parser, EVERY_COMMAND.values())


def _add_options(group: Any, options: Iterable[Option]) -> None:
    """Add options to a parser or a group of it; of an option and its replacement only one may be given."""
    options = list(options)
    replaced = {option.instead_of for option in options}
    exclusive: dict[str, Any] = {}
    for option in options:
        key = option.instead_of or option.name
        if key in replaced and key not in exclusive:
            exclusive[key] = group.add_mutually_exclusive_group()
        place = exclusive.get(key, group)
        place.add_argument(option.flag, dest=option.name, help=_help(option), **_reading(option))


def _reading(option: Option) -> dict[str, Any]:
    """Return how argparse reads an option's value; settings that are not given are left out."""
    if option.kind is bool:
        default: Any = argparse.SUPPRESS if option.name in OPTIONS else False
        return {"action": "store_const", "const": not option.default, "default": default}
    words: dict[str, Any] = {"type": option.kind, "metavar": option.metavar}
    words["default"] = argparse.SUPPRESS if option.name in OPTIONS else None
    if option.choices:
        # They are checked with the rest of the settings.
        words["metavar"] = "{" + ",".join(option.values) + "}"
    elif option.kind is Path:
        words["type"] = checked_folder if option.metavar == "DIR" else checked_path
    elif option.kind is tuple:
        words["type"] = checked_name
        words |= {"action": "append"} if option.repeated else {"nargs": "+"}
    return words


def _help(option: Option) -> str:
    """Return the description for the help, with the default and the methods that have the option."""
    text = option.off or option.description
    text = text[0].lower() + text[1:] if text[1].islower() else text
    if option.methods:
        few = len(option.methods) < len(METHODS)
        text += f" (for {', '.join(option.methods) if few else 'all methods'})"
    elif option.kind in (int, float) and option.default is not None:
        text += f" (default {plain(option.default)})"
    elif option.kind is str:
        text += f" (default {option.default})"
    return text.replace("%", "%%")
