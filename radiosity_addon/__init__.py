"""Radiosity Lightmaps: bake hierarchical radiosity into lightmaps.

Blender calls `register` and `unregister`; everything else is imported when it is used,
so that switching the extension on costs next to nothing.
"""

from __future__ import annotations


def register() -> None:
    """Add the operators, the panel, the settings and the command line to Blender."""
    from .blender import registration
    from .blender.command_line import host

    registration.register()
    try:
        host.register()
    except BaseException:
        registration.unregister()
        raise


def unregister() -> None:
    """Take out of Blender all that `register` added."""
    from .blender import registration

    registration.unregister()
