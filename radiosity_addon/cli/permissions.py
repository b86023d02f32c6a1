"""Permissions that users grant on the command line for actions that are not safe."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, repr=False)
class Permissions:
    """What is allowed.

    overwrite: Replace files that no earlier bake of this scene has written.
    scripts: Run the scripts and script expressions of a scene file that is opened.
    """

    overwrite: bool = False
    scripts: bool = False
