"""`python -m radiosity_addon`: the command line with Blender as a Python module."""

from __future__ import annotations

import os
import shutil
import sys
from typing import NoReturn

from .cli import main


def leave(code: int) -> NoReturn:
    """End the process without Blender's own clean-up, which crashes or hangs in some versions."""
    blender = sys.modules.get("bpy")
    if blender is not None:
        # Of that clean-up this alone would be missed: Blender's folder for temporary files.
        shutil.rmtree(blender.app.tempdir, ignore_errors=True)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    leave(main())
