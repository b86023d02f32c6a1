"""A digest of what a user can edit of a mesh, by which edits on stand-ins are noticed.

Our own layer and the material slots do not count, nor does what is selected.
"""

from __future__ import annotations

import hashlib
from typing import Any

import bpy
import numpy as np

from ...scene import LIGHTMAP_UV_LAYER
from ..datablocks.keyed_paths import curves
from ..datablocks.uv_layers import KEPT_VALUES, LayerRecord, layer_record

_VALUES = {  # attribute type → property of its elements, numbers in each, their type
    "FLOAT": ("value", 1, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
    "QUATERNION": ("value", 4, np.float32),
    "FLOAT4X4": ("value", 16, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "INT16_2D": ("value", 2, np.int32),
    "INT32_2D": ("value", 2, np.int32),
    "BOOLEAN": ("value", 1, np.bool_),
}

_SELECTION = (".select_", ".uv_select", ".vs.", ".es.")
"""How attributes begin that say what is selected."""

_DROPPED_WHERE_ZERO = frozenset(
    {
        "material_index", "sharp_face", "sharp_edge", "crease_edge", "crease_vert", "bevel_weight_edge",
        "bevel_weight_vert", "freestyle_edge", "freestyle_face", ".hide_vert", ".hide_edge", ".hide_poly",
    }
)  # fmt: skip
"""Attributes that Edit Mode leaves out where they are zero, which is their default."""

_NOT_COUNTED = {
    *("name", "use_fake_user", "use_extra_user", "tag"),
    *("uv_layer_clone_index", "uv_layer_stencil_index"),
}


def digest_of_mesh(mesh: bpy.types.Mesh) -> str:
    """Return the digest of a mesh, the same for its original and an unedited copy with our layer."""
    found = hashlib.blake2b(digest_size=16)
    record = layer_record(mesh)
    for name, attribute in sorted(_own_attributes(mesh, record), key=lambda found: found[0]):
        kind, values = attribute.data_type, attribute_bytes(attribute)
        if attribute.name == KEPT_VALUES:  # it was a UV layer, and will be one again
            kind, values = "FLOAT2", np.frombuffer(values, np.float32).reshape(-1, 3)[:, :2].tobytes()
        # Before Blender 5.0, merely reading a UV layer makes the attribute of its pins.
        if (name in _DROPPED_WHERE_ZERO or name.startswith(".pn.")) and not values.strip(b"\0"):
            continue
        found.update(f"{name}:{attribute.domain}:{kind};".encode())
        found.update(values)
    starts = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    found.update(starts.tobytes())
    if mesh.has_custom_normals and "custom_normal" not in mesh.attributes:  # before Blender 4.5
        normals = np.empty(3 * len(mesh.loops), dtype=np.float32)
        mesh.corner_normals.foreach_get("vector", normals)
        found.update(normals.tobytes())
    _add_shape_keys(mesh, found)
    weights = [(i, g.group, g.weight) for i, vertex in enumerate(mesh.vertices) for g in vertex.groups]
    found.update(np.array(weights, dtype=np.float64).tobytes())
    found.update(repr(_settings(mesh)).encode())
    return found.hexdigest()


def _own_attributes(
    mesh: bpy.types.Mesh, record: LayerRecord | None
) -> list[tuple[str, bpy.types.Attribute]]:
    """Return the user's attributes by the names they have without our layer."""
    ours, kept = record is not None and record.ours, "" if record is None else record.kept
    found = []
    for attribute in mesh.attributes:
        name = attribute.name
        if name.startswith(_SELECTION):
            continue
        if name.startswith(".pn."):
            layer = name.removeprefix(".pn.")
            if ours and layer == LIGHTMAP_UV_LAYER:
                continue
            name = f".pn.{LIGHTMAP_UV_LAYER}" if kept and layer == kept else name
        if kept and name == kept:
            name = LIGHTMAP_UV_LAYER
        elif name == KEPT_VALUES or (ours and name == LIGHTMAP_UV_LAYER):
            continue
        found.append((name, attribute))
    if KEPT_VALUES in mesh.attributes:
        found.append((LIGHTMAP_UV_LAYER, mesh.attributes[KEPT_VALUES]))
    return found


def attribute_bytes(attribute: Any) -> bytes:
    """Return the values of an attribute of a mesh, or of hair or points; of unknown kinds nothing."""
    if attribute.data_type == "STRING":
        return repr([item.value for item in attribute.data]).encode()
    if attribute.data_type not in _VALUES:
        return b""
    member, width, kind = _VALUES[attribute.data_type]
    values = np.empty(width * len(attribute.data), dtype=kind)
    attribute.data.foreach_get(member, values)
    return values.tobytes()


def _add_shape_keys(mesh: bpy.types.Mesh, found: Any) -> None:
    keys = mesh.shape_keys
    if keys is None:
        return
    moving = {curve.data_path for curve in curves(keys)}
    found.update(repr((keys.use_relative, _animation(keys))).encode())
    if "eval_time" not in moving:
        found.update(repr(keys.eval_time).encode())
    for key in keys.key_blocks:
        corners = np.empty(3 * len(key.data), dtype=np.float32)
        key.data.foreach_get("co", corners)
        found.update(repr((key.name, key.relative_key.name, key.mute, key.vertex_group)).encode())
        found.update(repr((key.slider_min, key.slider_max)).encode())
        if f"{key.path_from_id()}.value" not in moving:
            found.update(repr(key.value).encode())
        found.update(corners.tobytes())


def _animation(owner: bpy.types.ID) -> tuple[str, list[tuple[str, int, str]], list[str]] | None:
    """Return what animates a datablock: its action, its drivers, the tracks of its strips."""
    data = owner.animation_data
    if data is None:
        return None
    drivers = [(curve.data_path, curve.array_index, curve.driver.expression) for curve in data.drivers]
    action = "" if data.action is None else data.action.name
    found = action, drivers, [track.name for track in data.nla_tracks]
    return found if any(found) else None


def _settings(mesh: bpy.types.Mesh) -> list[tuple[str, object]]:
    """Return the mesh's plain settings and custom properties, except for ours."""
    plain = [
        (prop.identifier, getattr(mesh, prop.identifier))
        for prop in mesh.bl_rna.properties
        if prop.type in {"BOOLEAN", "INT", "FLOAT", "ENUM", "STRING"}
        and not prop.is_readonly
        and not getattr(prop, "is_array", False)
        and prop.identifier not in _NOT_COUNTED
    ]
    # Before Blender 5.0, properties of add-ons are among them, merely because somebody read them.
    known = mesh.bl_rna.properties
    names = [key for key in sorted(mesh.keys()) if key not in known and not key.startswith("radiosity")]
    custom = [(key, repr(mesh[key])) for key in names]
    return [*plain, *custom, ("animation", _animation(mesh))]
