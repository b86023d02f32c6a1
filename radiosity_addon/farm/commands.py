"""The commands that need no scene: `run` a bake that was prepared, help with one, and see how far it is."""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from ..base import RadiosityError
from ..cli import OUT_OF_MEMORY, Console, Interrupts, escaped, fail, read_farm_spec, with_notes
from ..numerics import thread_count
from .local_workers import LOOK, LocalWorkers
from .run_stage import run
from .signs import BakeWatch
from .spool import Spool
from .status import status_lines
from .worker import do_task, open_tasks, wait_for, work

INTERRUPTED = "interrupted; what was computed is kept in the spool: the same command goes on with it"

IDLE = 3600.0
"""Seconds after which a worker that finds nothing to do ends."""


def main(argv: Sequence[str] | None = None, prog: str = "python -m radiosity_addon.farm") -> int:
    """Run one command and return its exit code."""
    try:
        request = build_parser(prog).parse_args(argv)
        if request.verb == "run":
            return _run(request)
        if request.verb == "status":
            spool = Spool.to_work(request.spool)
            for line in open_tasks(spool) if request.tasks else status_lines(spool):
                _say(escaped(line))
            return 0
        if request.verb == "task":
            do_task(Spool.to_work(request.spool), request.name)
            return 0
        spool = wait_for(request.spool, request.wait)
        if request.processes is not None:
            return _work_in_processes(spool, request.processes)
        idle = math.inf if request.with_bake else request.idle
        _say(f"{work(spool, idle, _say, with_bake=request.with_bake)} tasks done")
    except RadiosityError as error:
        return fail(with_notes(str(error), error), error.exit_code)
    except SystemExit as refused:  # or help was asked for
        return int(refused.code or 0)
    except KeyboardInterrupt:
        return 130
    return 0


def build_parser(prog: str) -> argparse.ArgumentParser:
    """Return what reads a command; `prog` is how it is called."""
    parser = argparse.ArgumentParser(prog=prog, description="Share bakes.", allow_abbrev=False)
    verbs = parser.add_subparsers(dest="verb", required=True)
    run = verbs.add_parser("run", help="bake what `prepare` has put into a spool", allow_abbrev=False)
    run.add_argument("spool", type=Path, metavar="DIR")
    run.add_argument(
        "--farm", metavar="SPEC", help="start workers: local:N on this machine, or tls://HOST:PORT"
    )
    run.add_argument("--quiet", action="store_true", help="print errors only")
    worker = verbs.add_parser(
        "worker", help="do tasks of a bake with --spool DIR until it has ended", allow_abbrev=False
    )
    worker.add_argument("spool", type=Path, metavar="DIR")
    worker.add_argument(
        "--wait", type=_seconds, default=0.0, metavar="SECONDS", help="wait so long for the bake (default 0)"
    )
    worker.add_argument(
        "--idle",
        type=_seconds,
        default=IDLE,
        metavar="SECONDS",
        help=f"end after so long without work (default {IDLE:.0f})",
    )
    worker.add_argument(
        "--with-bake",
        action="store_true",
        help="end also when the bake is interrupted or killed, and not for want of work",
    )
    worker.add_argument(
        "--processes",
        type=_count,
        metavar="N",
        help="start N workers with --with-bake, 0 for one on each core, and end when they do",
    )
    status = verbs.add_parser("status", help="show what is done", allow_abbrev=False)
    status.add_argument("spool", type=Path, metavar="DIR")
    status.add_argument(
        "--tasks", action="store_true", help="list the tasks that nobody has begun, and nothing else"
    )
    task = verbs.add_parser("task", help="do one task that `status --tasks` lists", allow_abbrev=False)
    task.add_argument("name", metavar="NAME")
    task.add_argument("spool", type=Path, metavar="DIR")
    return parser


def _run(request: argparse.Namespace) -> int:
    """Run the stage that needs no Blender; Ctrl-C and SIGTERM interrupt it."""
    farm = None if request.farm is None else read_farm_spec(request.farm)
    with Interrupts() as interrupts, Console(quiet=request.quiet) as console:
        try:
            run(request.spool, farm, console, interrupts)
        except KeyboardInterrupt as interrupt:
            interrupts.deferred = True
            return fail(with_notes(INTERRUPTED, interrupt), 130)
        except RadiosityError as error:
            if interrupts.requested:  # what Ctrl-C has ended as well may fail first
                return fail(with_notes(INTERRUPTED, error), 130)
            raise
        except MemoryError:
            return fail(OUT_OF_MEMORY, 1)
    return 0


def _seconds(word: str) -> float:
    """Read a time. Raises ArgumentTypeError if it is none."""
    try:
        seconds = float(word)
    except ValueError:
        seconds = math.nan
    if not seconds >= 0:
        raise argparse.ArgumentTypeError(f"'{word}' is no number of seconds")
    return seconds


def _count(word: str) -> int:
    """Read a number of processes. Raises ArgumentTypeError if it is none."""
    if not (word.isascii() and word.isdecimal() and len(word) < 5):
        raise argparse.ArgumentTypeError(f"'{word}' is no number of processes")
    return int(word)


def _work_in_processes(spool: Spool, count: int) -> int:
    """Have some workers until the bake is over or gone; return 1 if one of them was given up."""
    workers, watch = LocalWorkers(thread_count(count)), BakeWatch(spool.sign)
    workers.start(spool)
    try:
        while not spool.is_over() and not watch.is_gone():
            time.sleep(LOOK)
    finally:
        workers.end()
    for problem in workers.problems:
        sys.stderr.write(f"error: {problem}\n")
    return int(bool(workers.problems))


def _say(line: str) -> None:
    try:
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has closed the pipe, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
