"""Everything that RNA tells of the open file, as plain data to compare before and after."""

from __future__ import annotations

import re
from typing import Any

import bpy

_FILE_COLLECTIONS = (
    "scenes", "objects", "collections", "meshes", "curves", "shape_keys", "materials", "node_groups",
    "images", "textures", "worlds", "lights", "cameras", "armatures", "actions", "particles",
    "libraries", "texts", "metaballs", "lattices",
)  # fmt: skip

# What belongs to the session or is a cache, not to the file (reading uv_sculpt crashes 4.2).
_VOLATILE = {
    "rna_type", "session_uid", "depsgraph", "loop_triangles", "loop_triangle_polygons", "bindcode",
    "is_evaluated", "preview", "asset_data", "original", "window_managers", "evaluated_depsgraph",
    "execution_time", "bl_system_properties_get", "warnings", "uv_sculpt", "storage_type",
}  # fmt: skip


def dump_file() -> dict[str, Any]:
    """Dump all datablocks of the open file by collection and name."""
    return {
        f"{collection}/{datablock.name_full}": _dump_struct(datablock, ())
        for collection in _FILE_COLLECTIONS
        for datablock in getattr(bpy.data, collection)
    }


def tidy_dump() -> dict[str, Any]:
    """Dump after what Blender puts off until somebody looks is done."""
    bpy.context.view_layer.update()
    dump_file()
    return dump_file()


def differences_since(before: dict[str, Any], after: dict[str, Any] | None = None) -> list[str]:
    """What is other in the open file, or in a later dump, than before, save for what Blender counts twice."""
    found = differences(before, dump_file() if after is None else after)
    if bpy.app.version < (5, 0):
        # Material.copy() counts what its nodes use twice there, until the next load.
        return [line for line in found if not re.match(r"/(images|node_groups)/.*/users: ", line)]
    return found


def differences(before: Any, after: Any, path: str = "") -> list[str]:
    """Where two dumps differ, one line each."""
    if isinstance(before, dict) and isinstance(after, dict):
        lines = [f"{path}/{key}: gone" for key in before.keys() - after.keys()]
        lines += [f"{path}/{key}: new" for key in after.keys() - before.keys()]
        for key in before.keys() & after.keys():
            lines += differences(before[key], after[key], f"{path}/{key}")
        return lines
    if isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        return [
            line
            for i, (a, b) in enumerate(zip(before, after, strict=True))
            for line in differences(a, b, f"{path}[{i}]")
        ]
    return [] if repr(before) == repr(after) else [f"{path}: {before!r:.120} -> {after!r:.120}"]


def _dump_struct(struct: Any, above: tuple[int, ...]) -> Any:
    """Dump one struct's properties; `above` holds the structs it is nested in."""
    if struct.as_pointer() in above:
        return "<itself>"
    above = (*above, struct.as_pointer())
    dump = {
        prop.identifier: _dump_property(struct, prop, above)
        for prop in struct.bl_rna.properties
        if prop.identifier not in _VOLATILE
    }
    if isinstance(struct, bpy.types.ID):
        dump["<custom>"] = {key: _plain(value) for key, value in struct.items()}
    return dump


def _dump_property(struct: Any, prop: Any, above: tuple[int, ...]) -> Any:
    """Dump one property; references to what is dumped elsewhere become names."""
    if prop.identifier.startswith("radiosity"):
        return struct.is_property_set(prop.identifier)  # reading it would create it in 4.2
    if prop.identifier == "data" and isinstance(struct, bpy.types.MeshUVLoopLayer):
        return None  # `uv` tells the same, and reading the eighth layer's crashes 4.2
    value = getattr(struct, prop.identifier)
    if prop.type == "POINTER":
        return _dump_reference(value, above)
    if prop.type == "COLLECTION":
        return [_dump_reference(item, above) for item in value]
    if getattr(prop, "is_array", False):
        return [list(row) if hasattr(row, "__len__") else row for row in value]
    return sorted(value) if isinstance(value, set) else value


def _dump_reference(value: Any, above: tuple[int, ...]) -> Any:
    """Dump what a pointer or a collection's item refers to."""
    if value is None:
        return None
    if isinstance(value, bpy.types.ID) and not value.is_embedded_data:
        return f"{value.rna_type.identifier} {value.name_full}"
    if isinstance(value, bpy.types.NodeLink):
        return [_socket_name(value.from_socket), _socket_name(value.to_socket), value.is_muted]
    if isinstance(value, bpy.types.NodeSocket) and len(above) > 3:
        return _socket_name(value)
    if isinstance(value, bpy.types.Node) and len(above) > 2:
        return value.name
    return _dump_struct(value, above)


def _plain(value: Any) -> Any:
    """Turn a custom property into plain data."""
    return value.to_dict() if hasattr(value, "to_dict") else repr(value)


def _socket_name(socket: Any) -> str:
    return f"{socket.node.name}:{socket.identifier}"
