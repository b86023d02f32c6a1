"""Run one command: parse its words, do what the verb asks for, and turn however it ends into an exit code.

What a verb does is imported when it runs: help and refusals need neither Blender nor NumPy.
"""

from __future__ import annotations

import argparse
import sys
import traceback
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ...base import RadiosityError
from ...cli import (
    OUT_OF_MEMORY,
    Console,
    Interrupts,
    Permissions,
    bake_output,
    build_parser,
    check_blend,
    check_keeping,
    check_plot,
    check_scene,
    check_sharing,
    fail,
    given_options,
    requested_settings,
    with_notes,
)
from ...options import ENGINE_PADDING, BakeSettings, Form, forms_of

if TYPE_CHECKING:
    from ...farm import PreparedBake

STAGED = ("bake", "prepare", "finish", "flip")
"""Verbs whose stages say when they may be interrupted."""

EXIT_DONE = 0
EXIT_FAILED = 1
EXIT_USAGE = 2
EXIT_INTERRUPTED = 130

INTERRUPTED = "interrupted; nothing was written"


def main(
    argv: Sequence[str] | None = None,
    prog: str = "python -m radiosity_addon",
    loaded: Path | None = None,
    interrupts: Interrupts | None = None,
) -> int:
    """Run one command and return its exit code; nothing is raised, nothing exits.

    argv: The words after the program's name; None takes them from the process.
    prog: How the user started us, for the help texts.
    loaded: The scene file the host has open already (`blender -b FILE --command …`): it is what a command
        without SCENE works on.
    interrupts: Those of the caller, if it has entered some.
    Returns code: 0 done, 1 scene or bake error, 2 usage, 130 interrupted.
    """
    try:
        request = build_parser(prog).parse_args(sys.argv[1:] if argv is None else list(argv))
        settings = requested_settings(request) if request.verb in ("bake", "prepare") else None
        if settings is not None:
            check_scene(request, loaded)
            check_sharing(request)
        is_written = request.verb == "finish" or (request.verb == "bake" and not request.check)
        if is_written:
            request.output = bake_output(request, loaded)
            check_plot(request.plot)
        if request.verb in ("flip", "restore"):
            check_blend(request.output)
        if settings is not None and not request.check:
            check_keeping(request, settings)
        wanted = request.forms if request.verb == "export" else getattr(request, "export", None)
        form = None if wanted is None else forms_of(wanted, request.sum_groups)
        if (
            settings is not None
            and form is not None
            and not request.relight
            and settings.padding is None
            and not settings.mip_levels
        ):
            settings = replace(settings, padding=ENGINE_PADDING)
    except RadiosityError as error:
        return fail(str(error), error.exit_code)
    except SystemExit as help_was_asked:
        return int(help_was_asked.code or 0)
    with Interrupts() if interrupts is None else nullcontext(interrupts) as those:
        return _run(request, settings, form, loaded, those)


def _run(
    request: argparse.Namespace,
    settings: BakeSettings | None,
    form: Form | None,
    loaded: Path | None,
    interrupts: Interrupts,
) -> int:
    """Run the verb and turn however it ends into an exit code."""
    try:
        from . import verbs
    except ModuleNotFoundError as error:
        return fail(
            f"{error.name} is not installed; run this through build.py or inside Blender", EXIT_FAILED
        )
    allowed = Permissions(request.overwrite, request.allow_scripts)
    try:
        interrupts.check()
        interrupts.deferred = request.verb in STAGED and not getattr(request, "check", False)
        with Console(quiet=request.quiet) as console:
            of_all = (allowed, console, interrupts)
            if request.verb == "prepare" and settings is not None:
                from .stage_verbs import prepare

                prepare(request.scene, loaded, request.spool, settings, _prepared(request, settings), *of_all)
            elif request.verb == "finish":
                from .stage_verbs import finish

                places = (request.output, request.spool, request.report, request.plot)
                finish(request.scene, loaded, *places, *of_all, after=after_bake)
            elif settings is not None and request.check:
                return verbs.check(request.scene, loaded, request.output, settings, allowed, console)
            elif settings is not None:
                _bake(request, settings, form, loaded, *of_all)
            elif request.verb == "flip":
                from .flip_verb import flip

                flip(request.scene, loaded, request.output, *of_all)
            elif request.verb == "restore":
                verbs.restore(request.scene, loaded, request.output, allowed, console)
            elif form is not None:
                from .export_verb import export

                interrupts.deferred = False
                export(request.folder, form, *of_all)
    except KeyboardInterrupt as interrupt:
        return fail(with_notes(INTERRUPTED, interrupt), EXIT_INTERRUPTED)
    except RadiosityError as error:
        # An importer that Ctrl-C stopped comes back with a failure of its own.
        if interrupts.requested:
            return fail(with_notes(INTERRUPTED, error), EXIT_INTERRUPTED)
        return fail(with_notes(str(error), error), error.exit_code)
    except MemoryError:
        return fail(OUT_OF_MEMORY, EXIT_FAILED)
    except Exception as error:  # noqa: BLE001 (the last resort: a code and a line, not a bare crash)
        traceback.print_exc()
        return fail(f"internal error, please report it: {type(error).__name__}: {error}", EXIT_FAILED)
    return EXIT_DONE


def _bake(
    request: argparse.Namespace,
    settings: BakeSettings,
    form: Form | None,
    loaded: Path | None,
    allowed: Permissions,
    console: Console,
    interrupts: Interrupts,
) -> None:
    """Bake or relight, and export if that is wanted too."""
    from ...bake import KeepOptions
    from . import verbs

    scene, output, preview = request.scene, request.output, not request.no_preview
    of_all = (allowed, console, interrupts)
    if request.relight:
        from .relight_verb import relight

        given = given_options(request)
        relight(scene, loaded, output, settings, given, request.report, *of_all, preview=preview, form=form)
    else:
        verbs.bake(
            scene,
            loaded,
            output,
            settings,
            request.report,
            request.plot,
            KeepOptions(sidecar=True) if request.keep else None,
            *of_all,
            preview=preview,
            form=form,
            baking=verbs.shared_with(output, request.spool, request.farm),
        )
    after_bake(output, form, *of_all)


def after_bake(
    output: Path, form: Form | None, allowed: Permissions, console: Console, interrupts: Interrupts
) -> None:
    """Export a bake that has just been published, or warn of an export that is older."""
    if form is None:
        from .outdated_exports import warn_of_outdated

        warn_of_outdated(output, console)
        return
    from .export_verb import export

    interrupts.deferred = False
    export(output, form, allowed, console, interrupts)


def _prepared(request: argparse.Namespace, settings: BakeSettings) -> PreparedBake:
    """Return what is to become of a bake that is prepared."""
    from ...farm import PreparedBake

    return PreparedBake(
        "", settings, request.keep, not request.no_preview, request.export, request.sum_groups
    )
