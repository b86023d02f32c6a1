"""The open file as one flat table, to compare before and after: each value of RNA, arrays by digest."""

from __future__ import annotations

import hashlib
from typing import Any

import bpy
import numpy as np

LEFT_OUT = {
    "window_managers", "screens", "workspaces", "brushes", "palettes", "libraries", "linestyles", "all_ids",
}  # fmt: skip
"""Kinds of datablocks that are no part of a scene, and the list of all kinds."""

# Of the session, computed, or dumped by `_mesh`; reading uv_sculpt crashes 4.2.
SKIPPED = {
    "rna_type", "session_uid", "depsgraph", "bindcode", "is_evaluated", "preview", "asset_data", "original",
    "execution_time", "bl_system_properties_get", "warnings", "uv_sculpt", "storage_type", "id_data", "tag",
    "bl_rna", "is_missing", "users", "all_objects", "children_recursive", "frame_float", "is_updated",
    "is_updated_data", "tool_settings", "matrix_world", "matrix_local", "dimensions", "bound_box",
    "face_count", "override_library", "library_weak_reference", "animation_data",
    "is_runtime_data",
}  # fmt: skip

MESH_ARRAYS = {
    "vertices", "edges", "loops", "polygons", "loop_triangles", "loop_triangle_polygons", "attributes",
    "color_attributes", "uv_layers", "vertex_normals", "polygon_normals", "corner_normals", "vertex_colors",
    "sculpt_vertex_colors", "skin_vertices", "vertex_layers_float", "edge_creases", "vertex_creases",
    "vertex_paint_masks", "uv_layer_stencil", "uv_layer_clone", "uv_layer_clone_index",
    "uv_layer_stencil_index",
    "total_vert_sel", "total_edge_sel", "total_face_sel", "has_custom_normals", "normals_domain",
    "texspace_location", "texspace_size",
}  # fmt: skip

VALUES = {
    "FLOAT": ("value", 1, np.float32), "INT": ("value", 1, np.int32), "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool), "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32), "BYTE_COLOR": ("color", 4, np.float32),
    "INT32_2D": ("value", 2, np.int32), "INT16_2D": ("value", 2, np.int32),
    "QUATERNION": ("value", 4, np.float32), "FLOAT4X4": ("value", 16, np.float32),
}  # fmt: skip

DEEPEST = 7
"""Structs in structs."""


def snapshot() -> dict[str, str]:
    """Return every value of the open file's datablocks by path."""
    table: dict[str, str] = {}
    for kind in dir(bpy.data):
        found = getattr(bpy.data, kind)
        if kind in LEFT_OUT or not isinstance(found, bpy.types.bpy_prop_collection):
            continue
        for block in found:
            path = f"{kind}/{block.name_full}"
            table[path] = "datablock"
            _struct(block, path, table, ())
            if isinstance(block, bpy.types.Mesh):
                _mesh(block, path, table)
            for key in block.keys():  # noqa: SIM118 (an ID is no mapping to iterate)
                if not str(key).startswith(("radiosity", "cycles")):
                    table[f"{path}[{key}]"] = repr(block[key])[:200]
    return table


def differences(before: dict[str, str], after: dict[str, str], most: int = 12) -> list[str]:
    """Tell where two tables differ; at most so many lines."""
    lines = [f"gone {path}" for path in before if path not in after]
    lines += [f"new {path}" for path in after if path not in before]
    both = (path for path in before if path in after and before[path] != after[path])
    lines += [f"{path}: {before[path][:60]} -> {after[path][:60]}" for path in both]
    blocks = [line for line in lines if line.count(".") == 0 or "datablock" in line]
    ordered = [*blocks, *(line for line in lines if line not in set(blocks))]
    return ordered[:most]


def _struct(struct: Any, path: str, table: dict[str, str], above: tuple[int, ...]) -> None:
    pointer = struct.as_pointer()
    if pointer in above or len(above) > DEEPEST:
        return
    is_mesh = isinstance(struct, bpy.types.Mesh)
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if name in SKIPPED or name.startswith("radiosity") or (is_mesh and name in MESH_ARRAYS):
            continue
        here = f"{path}.{name}"
        try:
            value = getattr(struct, name)
        except (AttributeError, RuntimeError, TypeError):
            continue
        if prop.type == "POINTER":
            _pointer(value, here, table, (*above, pointer))
        elif prop.type == "COLLECTION":
            table[f"{here}.len"] = str(len(value))
            for number, item in enumerate(value):
                _pointer(item, f"{here}[{number}]", table, (*above, pointer))
        elif getattr(prop, "is_array", False):
            table[here] = repr([tuple(row) if hasattr(row, "__len__") else row for row in value])
        else:
            table[here] = repr(value)


def _pointer(value: Any, path: str, table: dict[str, str], above: tuple[int, ...]) -> None:
    if value is None:
        table[path] = "None"
    elif isinstance(value, bpy.types.ID) and not value.is_embedded_data:
        table[path] = f"-> {type(value).__name__} {value.name_full}"
    else:
        _struct(value, path, table, above)


def _mesh(mesh: bpy.types.Mesh, path: str, table: dict[str, str]) -> None:
    for kind, name, width, dtype in (
        ("vertices", "co", 3, np.float32),
        ("edges", "vertices", 2, np.int32),
        ("loops", "vertex_index", 1, np.int32),
        ("polygons", "loop_start", 1, np.int32),
        ("polygons", "material_index", 1, np.int32),
        ("polygons", "use_smooth", 1, bool),
    ):
        table[f"{path}.{kind}.{name}"] = digest(getattr(mesh, kind), name, width, dtype)
    table[f"{path}.uv_layers"] = repr([(layer.name, layer.active_render) for layer in mesh.uv_layers])
    table[f"{path}.uv_layers.active"] = str(mesh.uv_layers.active_index)
    for attribute in mesh.attributes:
        known = VALUES.get(attribute.data_type)
        here = f"{path}.attributes.{attribute.name}"
        table[here] = f"{attribute.domain} {attribute.data_type}"
        if known is not None:
            name, width, dtype = known
            table[f"{here}.data"] = digest(attribute.data, name, width, dtype)


def digest(collection: Any, name: str, width: int, dtype: Any) -> str:
    """Return the length and the digest of an array."""
    values = np.empty(len(collection) * width, dtype=dtype)
    collection.foreach_get(name, values)
    return f"{len(collection)} {hashlib.sha256(values.tobytes()).hexdigest()[:12]}"
