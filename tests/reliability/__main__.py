"""`python -m tests.reliability VERB`: the full runs of docs/reliability.md."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

from .command import ROOT
from .tally import Tally

OUTCOMES = ROOT / "out" / "reliability"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.reliability", description=__doc__)
    verbs = parser.add_subparsers(dest="verb", required=True)
    for verb, count, text in (
        ("scenes", 2000, "random scenes, baked, edited, and restored"),
        ("damage", 320, "damaged files, given to the command line"),
        ("kills", 200, "bakes killed at random moments"),
        ("disk", 20, "full, read-only and inode-less file systems"),
        ("calls", 0, "every file system call of publishing, made to fail"),
    ):
        add = verbs.add_parser(verb, help=text).add_argument
        add("--name", default=verb, help="of the outcomes' file; one that exists is gone on with")
        if verb == "calls":
            add("--every", type=int, default=1, metavar="N", help="only every N-th call")
            continue
        add("--count", type=int, default=count, help=f"how many (default {count})")
        if verb in ("scenes", "damage"):
            add("--first", type=int, default=0, help="the first seed (default 0)")
            add("--workers", type=int, default=2, help="processes at a time (default 2)")
    asked = parser.parse_args()
    OUTCOMES.mkdir(parents=True, exist_ok=True)
    return RUNS[asked.verb](asked)


def _tally(asked: argparse.Namespace, folder: Path = OUTCOMES) -> Tally:
    return Tally(asked.verb, folder / f"{asked.name}.jsonl")


def _scenes(asked: argparse.Namespace) -> int:
    from .scenes import run_all

    tally = _tally(asked)
    run_all(tally, range(asked.first, asked.first + asked.count), asked.workers)
    return tally.finish()


def _damage(asked: argparse.Namespace) -> int:
    from .damage import run_all

    tally = _tally(asked)
    with tempfile.TemporaryDirectory() as folder:
        run_all(tally, Path(folder), range(asked.first, asked.first + asked.count), asked.workers)
    return tally.finish()


def _kills(asked: argparse.Namespace) -> int:
    from .kills import run_all

    tally = _tally(asked)
    with tempfile.TemporaryDirectory() as folder:
        run_all(tally, Path(folder) / "sandbox", asked.count)
    return tally.finish()


def _disk(asked: argparse.Namespace) -> int:
    from .full_disk import INSIDE, can_mount, enter, run_all

    if not os.environ.get(INSIDE):
        if not can_mount():
            sys.stderr.write("disk: file systems can only be mounted by root, on Linux\n")
            return 2
        return enter(sys.argv[1:])
    tally = _tally(asked, Path("/mnt/out"))
    run_all(tally, asked.count)
    return tally.finish()


def _calls(asked: argparse.Namespace) -> int:
    import radiosity_addon

    from .failing_calls import run_all
    from .quiet import quiet

    tally = _tally(asked)
    with tempfile.TemporaryDirectory() as folder, quiet():
        radiosity_addon.register()
        run_all(tally, Path(folder) / "sandbox", asked.every)
    return tally.finish()


RUNS = {"scenes": _scenes, "damage": _damage, "kills": _kills, "disk": _disk, "calls": _calls}

if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    # Blender's own end may crash or hang while our classes are registered.
    os._exit(code)
