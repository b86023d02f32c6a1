"""Run one command: parse its words, do what the verb asks for, and turn however it ends into an exit code.

What a verb does is imported when it runs: help and refusals need neither Blender nor NumPy.
"""

from __future__ import annotations

import argparse
import sys
import traceback
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path

from ...base import RadiosityError
from ...cli import (
    Console,
    Interrupts,
    Permissions,
    bake_output,
    build_parser,
    check_keeping,
    check_plot,
    check_sharing,
    printable,
    requested_settings,
)
from ...options import ENGINE_PADDING, BakeSettings, Form, forms_of

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
        settings = requested_settings(request) if request.verb == "bake" else None
        if settings is not None:
            check_sharing(request)
        if settings is not None and not request.check:
            request.output = bake_output(request, loaded)
            check_plot(request.plot)
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
        return _fail(str(error), error.exit_code)
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
        return _fail(
            f"{error.name} is not installed; run this through build.py or inside Blender", EXIT_FAILED
        )
    allowed = Permissions(request.overwrite, request.allow_scripts)
    try:
        interrupts.check()
        interrupts.deferred = request.verb == "bake" and not request.check  # its stages say when
        with Console(quiet=request.quiet) as console:
            if settings is not None and request.check:
                return verbs.check(request.scene, loaded, request.output, settings, allowed, console)
            if settings is not None and request.relight:
                from .relight_verb import relight

                relight(
                    request.scene,
                    loaded,
                    request.output,
                    settings,
                    request.report,
                    allowed,
                    console,
                    interrupts,
                    preview=not request.no_preview,
                    form=form,
                )
            elif settings is not None:
                verbs.bake(
                    request.scene,
                    loaded,
                    request.output,
                    settings,
                    request.report,
                    request.plot,
                    request.keep,
                    allowed,
                    console,
                    interrupts,
                    preview=not request.no_preview,
                    form=form,
                    spool=request.spool,
                    farm=request.farm,
                )
            elif request.verb == "restore":
                verbs.restore(request.scene, loaded, request.output, allowed, console)
            if form is None and settings is not None:
                from .outdated_exports import warn_of_outdated

                warn_of_outdated(request.output, console)
            if form is not None:
                from .export_verb import export

                interrupts.deferred = False
                export(
                    request.folder if settings is None else request.output, form, allowed, console, interrupts
                )
    except KeyboardInterrupt as interrupt:
        return _fail(_with_notes(INTERRUPTED, interrupt), EXIT_INTERRUPTED)
    except RadiosityError as error:
        # An importer that Ctrl-C stopped comes back with a failure of its own.
        if interrupts.requested:
            return _fail(_with_notes(INTERRUPTED, error), EXIT_INTERRUPTED)
        return _fail(_with_notes(str(error), error), error.exit_code)
    except MemoryError:
        return _fail("out of memory; lower the resolution, the texel density or the quality", EXIT_FAILED)
    except Exception as error:  # noqa: BLE001 (the last resort: a code and a line, not a bare crash)
        traceback.print_exc()
        return _fail(f"internal error, please report it: {type(error).__name__}: {error}", EXIT_FAILED)
    return EXIT_DONE


def _with_notes(message: str, error: BaseException) -> str:
    """Return an error's message, and what its way up has added to it."""
    return "; ".join((message, *getattr(error, "__notes__", ())))


def _fail(message: str, code: int) -> int:
    with suppress(OSError, ValueError):  # nobody may read it: the exit code still says it
        print(f"error: {printable(message)}", file=sys.stderr, flush=True)  # noqa: T201
    return code
