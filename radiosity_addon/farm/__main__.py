"""`python -m radiosity_addon.farm worker DIR` and `… status DIR`; needs no Blender."""

from __future__ import annotations

import sys

from .commands import main

if __name__ == "__main__":
    sys.exit(main())
