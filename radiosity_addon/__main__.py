"""`python -m radiosity_addon`: the command line with Blender as a Python module."""

from __future__ import annotations

import os
import sys

from .cli import main

if __name__ == "__main__":
    code = main()
    # Blender's own clean-up at interpreter exit crashes or hangs in some versions of
    # the module; everything is written by now, so leave without it.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
