"""Adding the UV layer `Lightmap` to a mesh, and removing it so that the mesh is as before.

A mesh with the layer has a record of it in a custom property, which is copied along with the mesh. A layer
of the user's that has this name gets another one meanwhile; where eight layers leave no room for that, its
values go into an attribute. Either way they follow the mesh through edits.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...base import BakeError, SceneError
from ...scene import LIGHTMAP_UV_LAYER
from .bake_record import LAYER

MAX_UV_LAYERS = 8
"""Maximum number of UV layers in Blender."""

KEPT_NAME = f"{LIGHTMAP_UV_LAYER} (original)"
"""The name of the user's layer while ours has its name."""

KEPT_VALUES = "radiosity_kept_uv"
"""The attribute that holds the user's layer where there is no room for two."""


@dataclass(frozen=True)
class LayerRecord:
    """A bake's changes to the layers and slots of a mesh.

    ours: The layer `Lightmap` is ours; False where the user's own was kept as it is.
    kept: The present name of the user's layer `Lightmap`; "" if there was none.
    active, rendered: The layers that had these roles; "" for none.
    slots: Material slots that were added.
    """

    ours: bool = True
    kept: str = ""
    active: str = ""
    rendered: str = ""
    slots: int = 0


def layer_record(mesh: bpy.types.Mesh) -> LayerRecord | None:
    """Return a mesh's record of our UV layer; None if it has none."""
    text = mesh.get(LAYER)
    if text is None:
        return None
    try:
        return LayerRecord(**json.loads(text))
    except (ValueError, TypeError):
        return LayerRecord(ours=False)


def set_record(mesh: bpy.types.Mesh, record: LayerRecord) -> None:
    """Store the record on the mesh."""
    mesh[LAYER] = json.dumps(vars(record))


def check_room(mesh: bpy.types.Mesh, object_name: str) -> None:
    """Refuse a mesh that cannot take the layer.

    Raises SceneError if it has eight other UV layers, or something else of the layer's name.
    """
    if LIGHTMAP_UV_LAYER in mesh.uv_layers:
        return
    if len(mesh.uv_layers) >= MAX_UV_LAYERS:
        raise SceneError(
            f"object '{object_name}' has {len(mesh.uv_layers)} UV layers and Blender allows no ninth: "
            f"remove one to make room for '{LIGHTMAP_UV_LAYER}'"
        )
    if LIGHTMAP_UV_LAYER in mesh.attributes:
        raise SceneError(
            f"object '{object_name}' has an attribute '{LIGHTMAP_UV_LAYER}' that is not a UV layer: rename it"
        )


def put_layer_on(mesh: bpy.types.Mesh, loops: np.ndarray, uv: np.ndarray, object_name: str) -> None:
    """Add the layer `Lightmap`, and record the previous state; active layers do not change.

    mesh: `check_room` has passed it.
    loops (n, 3) int32: The mesh corner of each triangle corner.
    uv (n, 3, 2) float32: Its coordinates; corners of no triangle get (0, 0).
    object_name: For the error.
    Raises BakeError if the mesh has fewer corners than `loops` names.
    """
    if loops.size and int(loops.max()) >= len(mesh.loops):
        raise BakeError(f"object '{object_name}' changed while it was being baked: bake again")
    corners, wanted = loops.ravel(), np.asarray(uv, dtype=np.float32).reshape(-1, 2)
    coordinates = np.zeros((len(mesh.loops), 2), dtype=np.float32)
    coordinates[corners] = wanted
    take_layer_off(mesh)
    if LIGHTMAP_UV_LAYER in mesh.uv_layers:
        # Kept coordinates are the user's own layer: nothing to add.
        same = np.array_equal(_values(mesh, LIGHTMAP_UV_LAYER)[corners], wanted)
        if same:
            set_record(mesh, LayerRecord(ours=False))
            return
    set_record(mesh, _put_on(mesh, coordinates))


def layer_values(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """Return (corners, 2) float32 of our layer; None if the mesh has none."""
    record = layer_record(mesh)
    if record is None or not record.ours or LIGHTMAP_UV_LAYER not in mesh.uv_layers:
        return None
    return _values(mesh, LIGHTMAP_UV_LAYER)


def put_back_layer(mesh: bpy.types.Mesh, record: LayerRecord, values: np.ndarray | None) -> None:
    """Restore the results of `layer_values` and `layer_record` from before the layer was removed."""
    if values is not None and len(values) == len(mesh.loops):
        record = replace(record, kept=_put_on(mesh, values).kept)
    set_record(mesh, record)


def take_layer_off(mesh: bpy.types.Mesh) -> None:
    """Remove our layer; the user's own `Lightmap` gets its name, position and values back."""
    record = layer_record(mesh)
    if record is None:
        return
    del mesh[LAYER]
    layers = mesh.uv_layers
    active, rendered = _roles(mesh)
    if record.ours and LIGHTMAP_UV_LAYER in layers:
        if KEPT_VALUES in mesh.attributes:
            _take_values_back(mesh)
        else:
            layers.remove(layers[LIGHTMAP_UV_LAYER])
            active = record.active if active == LIGHTMAP_UV_LAYER else active
            rendered = record.rendered if rendered == LIGHTMAP_UV_LAYER else rendered
    if record.kept and record.kept in layers and LIGHTMAP_UV_LAYER not in layers:
        layers[record.kept].name = LIGHTMAP_UV_LAYER
        active = LIGHTMAP_UV_LAYER if active == record.kept else active
        rendered = LIGHTMAP_UV_LAYER if rendered == record.kept else rendered
    _set_roles(mesh, active, rendered)


def _put_on(mesh: bpy.types.Mesh, coordinates: np.ndarray) -> LayerRecord:
    """Add the layer; return its record."""
    layers = mesh.uv_layers
    kept = ""
    active, rendered = _roles(mesh)
    before = active, rendered
    if LIGHTMAP_UV_LAYER in layers and len(layers) < MAX_UV_LAYERS:
        place = layers.find(LIGHTMAP_UV_LAYER)
        layers[place].name = KEPT_NAME
        kept = layers[place].name  # numbered where that name was taken
        active = kept if active == LIGHTMAP_UV_LAYER else active
        rendered = kept if rendered == LIGHTMAP_UV_LAYER else rendered
    elif LIGHTMAP_UV_LAYER in layers:
        _keep_values(mesh, _values(mesh, LIGHTMAP_UV_LAYER))
    if LIGHTMAP_UV_LAYER not in layers:
        layers.new(name=LIGHTMAP_UV_LAYER, do_init=False)
    _write(mesh, LIGHTMAP_UV_LAYER, coordinates)
    _set_roles(mesh, active, rendered)
    return LayerRecord(kept=kept, active=before[0], rendered=before[1])


def roles(mesh: bpy.types.Mesh) -> tuple[str, str]:
    """Return the names of the user's layers that are active and that renders use, as without ours."""
    record = layer_record(mesh) or LayerRecord(ours=False)

    def without_ours(name: str, before: str) -> str:
        if record.ours and name == LIGHTMAP_UV_LAYER:
            return before
        return LIGHTMAP_UV_LAYER if record.kept and name == record.kept else name

    active, rendered = _roles(mesh)
    return without_ours(active, record.active), without_ours(rendered, record.rendered)


def give_roles(mesh: bpy.types.Mesh, wanted: tuple[str, str]) -> None:
    """Make the user's layers of these names active and used for renders."""
    record = layer_record(mesh) or LayerRecord(ours=False)
    active, rendered = (record.kept if record.kept and name == LIGHTMAP_UV_LAYER else name for name in wanted)
    _set_roles(mesh, active, rendered)


def _roles(mesh: bpy.types.Mesh) -> tuple[str, str]:
    """Return the names of the active layer and of the one that renders use; "" without any."""
    layers = mesh.uv_layers
    active = layers.active.name if layers.active else ""
    return active, next((layer.name for layer in layers if layer.active_render), "")


def _set_roles(mesh: bpy.types.Mesh, active: str, rendered: str) -> None:
    layers = mesh.uv_layers
    if active in layers:
        layers.active = layers[active]
    if rendered in layers:
        layers[rendered].active_render = True


def _values(mesh: bpy.types.Mesh, name: str) -> np.ndarray:
    values = np.empty((len(mesh.loops), 2), dtype=np.float32)
    mesh.attributes[name].data.foreach_get("vector", values.ravel())
    return values


def _write(mesh: bpy.types.Mesh, name: str, values: np.ndarray) -> None:
    # Not through layers[...].uv: before Blender 5.2 that writes into the array which a
    # copied mesh still shares with its original, and so changes both.
    mesh.attributes[name].data.foreach_set("vector", np.ascontiguousarray(values).ravel())


def keep_values_of(mesh: bpy.types.Mesh, original: bpy.types.Mesh) -> None:
    """Keep the values of another mesh's `Lightmap` as the user's layer, if it has the same corners."""
    if len(original.loops) == len(mesh.loops):
        _keep_values(mesh, _values(original, LIGHTMAP_UV_LAYER))


def _keep_values(mesh: bpy.types.Mesh, coordinates: np.ndarray) -> None:
    values = np.zeros((len(mesh.loops), 3), dtype=np.float32)
    values[:, :2] = coordinates
    active = mesh.attributes.active_index
    mesh.attributes.new(KEPT_VALUES, "FLOAT_VECTOR", "CORNER")
    mesh.attributes[KEPT_VALUES].data.foreach_set("vector", values.ravel())
    mesh.attributes.active_index = active


def _take_values_back(mesh: bpy.types.Mesh) -> None:
    values = np.empty((len(mesh.loops), 3), dtype=np.float32)
    mesh.attributes[KEPT_VALUES].data.foreach_get("vector", values.ravel())
    _write(mesh, LIGHTMAP_UV_LAYER, values[:, :2])
    mesh.attributes.remove(mesh.attributes[KEPT_VALUES])
