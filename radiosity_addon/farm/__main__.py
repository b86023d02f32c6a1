"""`python -m radiosity_addon.farm worker DIR` and `… status DIR`; needs no Blender."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from ..base import RadiosityError
from .spool import Spool
from .status import status_lines
from .worker import work

IDLE = 3600.0
"""Seconds after which a worker that finds nothing to do ends."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m radiosity_addon.farm", description="Share bakes.")
    verbs = parser.add_subparsers(dest="verb", required=True)
    worker = verbs.add_parser("worker", help="do tasks of a bake with --spool DIR until it has ended")
    worker.add_argument("spool", type=Path, metavar="DIR")
    worker.add_argument("--idle", type=float, default=IDLE, help="seconds without work to end after")
    status = verbs.add_parser("status", help="show what is done")
    status.add_argument("spool", type=Path, metavar="DIR")
    request = parser.parse_args(argv)
    try:
        spool = Spool.to_work(request.spool)
        if request.verb == "status":
            _say("\n".join(status_lines(spool)))
        else:
            _say(f"{work(spool, request.idle, _say)} tasks done")
    except RadiosityError as error:
        sys.stderr.write(f"error: {error}\n")
        return error.exit_code
    except KeyboardInterrupt:
        return 130
    return 0


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
