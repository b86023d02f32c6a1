"""The command line's own folder for temporary files: Blender's go there, and all of it goes at the end.

Blender makes a folder of its own in TMPDIR, or takes TMPDIR itself where it cannot, and a process that is
killed leaves it behind. Ours is marked, so the next start can remove what a kill has left.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from ..publishing import MarkedFolder, clean_up_folders

PREFIX = "radiosity-"
_OF_BLENDER = r"blender_\w{6}"
"""Names of the folders that Blender makes for itself."""

_VARIABLES = ("TMPDIR", "TEMP", "TMP")
"""Where Blender, Python and child processes look."""


class TemporaryFolder:
    """A temporary folder for this process and its children; call before Blender is imported.

    Where none can be made, as on a full disk, everything stays as it is, and nothing is removed at the end
    but the folder that Blender made for itself, if it is empty.
    """

    def __init__(self) -> None:
        self._folder: MarkedFolder | None = None
        try:
            parent = Path(tempfile.gettempdir()).resolve()
            clean_up_folders(parent, PREFIX)
            self._folder = MarkedFolder(parent, PREFIX)
        except OSError:
            return
        for name in _VARIABLES:
            os.environ[name] = str(self._folder.path)
        tempfile.tempdir = None  # Python looks again

    @property
    def path(self) -> Path | None:
        """The folder, if there is one."""
        return None if self._folder is None else self._folder.path

    def remove(self) -> None:
        """Remove the folder or, where none could be made, Blender's own empty one; nothing else."""
        if self._folder is not None:
            self._folder.close()
            self._folder = None
            return
        blender = getattr(sys.modules.get("bpy"), "app", None)
        given = [Path(os.environ[name]) for name in _VARIABLES if os.environ.get(name)]
        made = Path(blender.tempdir) if blender is not None and blender.tempdir else None
        # Where Blender could make no folder either, it names the one that it was given.
        if made is not None and re.fullmatch(_OF_BLENDER, made.name) and made not in given:
            with suppress(OSError):
                made.rmdir()  # as long as it is empty
