"""Radiosity Lightmaps: bake hierarchical radiosity into lightmaps.

Blender calls `register` and `unregister`; everything else is imported when it is used,
so that switching the extension on costs next to nothing.
"""

from __future__ import annotations

from typing import Any


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


def glTF2_pre_export_callback(export_settings: dict[str, Any]) -> None:  # noqa: N802 - the exporter's name
    """Called by Blender's glTF exporter before it reads the scene."""
    from .blender.exporting import gltf_hook

    gltf_hook.before(export_settings)


def glTF2_post_export_callback(export_settings: dict[str, Any]) -> None:  # noqa: N802 - the exporter's name
    """Called by Blender's glTF exporter once it has read the scene."""
    from .blender.exporting import gltf_hook

    gltf_hook.after(export_settings)


def glTF2ExportUserExtension() -> Any:  # noqa: N802 - the exporter's name
    """Return the hooks for Blender's glTF exporter."""
    from .blender.exporting.gltf_hook import LightmapExtension

    return LightmapExtension()


def glTF2ImportUserExtension() -> Any:  # noqa: N802 - the importer's name
    """Return the hooks for Blender's glTF importer."""
    from .blender.files.imported_lightmaps import LightmapImport

    return LightmapImport()


def unregister() -> None:
    """Take out of Blender all that `register` added."""
    from .blender import registration

    registration.unregister()
