"""`python -m radiosity_addon`: the command line with Blender as a Python module."""

from __future__ import annotations

import os
import sys
from typing import NoReturn

from .cli import Interrupts, TemporaryFolder


def leave(code: int, temporary: TemporaryFolder) -> NoReturn:
    """End the process without Blender's own clean-up, which crashes or hangs in some versions."""
    # Of that clean-up this alone would be missed: Blender's temporary files, which are in our folder.
    temporary.remove()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    with Interrupts() as interrupts:
        from .blender.command_line.main import main  # Ctrl-C waits while modules are imported

        temporary = TemporaryFolder()
        code = main(interrupts=interrupts)
        interrupts.deferred = True
        leave(code, temporary)
