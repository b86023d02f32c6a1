"""The errors that a bake can end with, each one line that names the cause and the fix.

Every front door (command line, N-panel, Python) reports these and lets anything else
through: an exception that is not a `RadiosityError` is a defect of ours.
"""

from __future__ import annotations


class RadiosityError(Exception):
    """Base of all named errors; `exit_code` is what the command line returns."""

    exit_code = 1


class SceneError(RadiosityError):
    """The scene cannot be baked as it is; the message names the object and the fix."""


class BakeError(RadiosityError):
    """The scene is fine but the bake could not be finished or written."""


class UsageError(RadiosityError):
    """The request itself makes no sense: an unknown object, options that exclude each other."""

    exit_code = 2


class NothingToDoError(RadiosityError):
    """The requested work is already done."""
