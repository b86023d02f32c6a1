"""*Changed*: which objects differ from those of the last bake, and so get new lightmaps; others keep theirs.

An object has changed if its triangles, their shading normals, its reflectance or opacity, its texel scale
or its part in the light have. Where lamps, emission, the world or the settings have changed, everything is
lit anew. What is kept is kept as it is: the shadows and bounces that changed objects throw on others are
not renewed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import bpy
import numpy as np

from ...bake.result import BakeResult
from ...base import BakeWarning, NothingToDoError
from ...options import BakeSettings
from ...scene import BakeObject, BakeScene
from ..datablocks.bake_record import shows_lightmap
from ..scene_records.export_sources import Export
from .scopes import files_of

STEP = 1.0 / 256.0
"""How far a texture's reflectance has to change to be seen: it is stored in other places every time."""

_POINTS = np.array([[1, 1], [4, 1], [1, 4], [2, 2]]) / 6.0
"""Where a textured triangle is looked at, beside its mean."""

_OF_NO_CONSEQUENCE = frozenset({"objects", "threads", "memory_limit", "unwrap_seconds"})
"""Settings that change no texel of what is kept."""


_NAMED = 5
"""Objects that a warning names."""


def kept_warning(count: int, gone: Sequence[str]) -> BakeWarning:
    """Say what was not renewed: `count` objects kept their lightmaps, and others are gone."""
    message = (
        f"{count} unchanged objects kept their lightmaps: light and shadow that the changed "
        "ones throw on them are as before; bake all to renew them"
    )
    return BakeWarning("scene", f"{message}; {_gone_words(gone)}" if gone else message)


def gone_objects(scene: bpy.types.Scene, bake_scene: BakeScene) -> list[str]:
    """Return the names of the objects that the last bake had and this one has not, but for renamed ones."""
    before = json.loads(scene.radiosity.baked_objects or "{}")
    names = {item.name for item in bake_scene.objects}
    gone = [name for name in before if name not in names]
    if not gone:
        return []
    now = {_short_print(bake_scene, item) for item in bake_scene.objects}
    return [name for name in gone if before[name] not in now]


def _gone_words(gone: Sequence[str]) -> str:
    named = ", ".join(f"'{name}'" for name in gone[:_NAMED])
    more = f" and {len(gone) - _NAMED} more" if len(gone) > _NAMED else ""
    return f"gone since the last bake: {named}{more}; light and shadow from there stay until you bake all"


def _short_print(bake_scene: BakeScene, item: BakeObject) -> str:
    return object_digest(bake_scene, item)[:16]


def restrict_to_changed(
    scene: bpy.types.Scene, export: Export, settings: BakeSettings
) -> tuple[Export, BakeSettings, int]:
    """Leave lightmaps to what has changed since the last bake; to all where the light has.

    Returns the export, the settings, and how many objects have not changed.

    Raises
    ------
    NothingToDoError
        If nothing has.
    """
    everything = export, settings, 0
    bake_scene = export.bake_scene
    pairs = [
        (source, target)
        for source, target in zip(export.sources, bake_scene.objects, strict=True)
        if target.bake
    ]
    if any(source.is_instance or source.makes_instances for source, _ in pairs):
        return everything
    kept, densities = set(), []
    light = light_digest(bake_scene, settings)
    for source, target in pairs:
        obj = bpy.data.objects.get((source.object_name, None))
        if obj is None or not obj.is_property_set("radiosity_bake"):
            continue
        record = obj.radiosity_bake
        if record.scene not in {"", scene.name} or (record.light or scene.radiosity.baked_light) != light:
            continue
        shows = record.is_baked and shows_lightmap(obj) and files_of(obj)
        if shows and record.fingerprint == object_digest(bake_scene, target):
            kept.add(target.name)
            densities.append(record.texels_per_metre)
    if not kept:
        return everything
    if any(len(files_of(bpy.data.objects[name, None])) > 1 for name in kept):
        return everything  # light groups, whose lightmaps are made together
    if len(kept) == len(pairs):
        gone = gone_objects(scene, bake_scene)
        if gone:
            raise NothingToDoError(f"no object has changed that gets a lightmap, but {_gone_words(gone)}")
        raise NothingToDoError("nothing has changed since the last bake: there is nothing to do")
    narrowed = tuple(replace(item, bake=item.bake and item.name not in kept) for item in bake_scene.objects)
    if settings.atlas == "shared" and settings.texel_density is None:
        # As sharp as what is kept, on a page of their own.
        settings = replace(settings, texel_density=float(np.median(densities)), pages=1)
    narrow_scene = replace(bake_scene, objects=narrowed)
    return replace(export, bake_scene=narrow_scene), settings, len(kept)


def remember(scene: bpy.types.Scene, export: Export, result: BakeResult, settings: BakeSettings) -> None:
    """Note on every object what it was baked as, and on the scene which objects there were."""
    sources = {
        target.name: source for source, target in zip(export.sources, export.bake_scene.objects, strict=True)
    }
    light = light_digest(export.bake_scene, settings)
    for baked in result.objects:
        source = sources[baked.object.name]
        obj = bpy.data.objects.get((source.object_name, None))
        if obj is None or source.is_instance or not obj.is_property_set("radiosity_bake"):
            continue
        obj.radiosity_bake.fingerprint = object_digest(export.bake_scene, baked.object)
        told = result.atlas[baked.page] if result.atlas else {}
        obj.radiosity_bake.texels_per_metre = told.get("texels_per_metre", 0.0)
        obj.radiosity_bake.light = light
    scene.radiosity.baked_light = light
    prints = {item.name: _short_print(export.bake_scene, item) for item in export.bake_scene.objects}
    scene.radiosity.baked_objects = json.dumps(prints)


def object_digest(bake_scene: BakeScene, item: BakeObject) -> str:
    """Return a digest of an object's shape, of how it reflects, and of its texel scale."""
    scene, rows = bake_scene.scene, item.rows
    digest = hashlib.sha256(f"{item.texel_scale:.6g}".encode())
    flags = (scene.in_bounces[rows], scene.in_shadows[rows])
    shape = (scene.triangles[rows], scene.normals[rows])
    for values in (*shape, scene.reflectance[rows] / STEP, scene.opacity[rows] / STEP):
        # Rounded, so that what is computed anew may differ by a rounding.
        digest.update(np.round(values, 4 if values.ndim == 3 else 0).astype(np.float32).tobytes())
    for values in flags:
        digest.update(np.ascontiguousarray(values).tobytes())
    if scene.images is not None:
        triangle = item.first + np.flatnonzero(scene.images.textured[rows])
        for point in _POINTS:
            seen = scene.images.at(triangle, np.broadcast_to(point, (len(triangle), 2)))
            weighed = np.concatenate([seen[:, :3], seen[:, 6:]], axis=1)
            digest.update(np.round(weighed / STEP).astype(np.int16).tobytes())
    return digest.hexdigest()


def light_digest(bake_scene: BakeScene, settings: BakeSettings) -> str:
    """Return a digest of all that shines, and of the settings: what every lightmap depends on."""
    digest = hashlib.sha256()
    for light in bake_scene.scene.lights:
        if not light.strength.any():
            continue  # a kept bake knows dark lamps too
        digest.update(type(light).__name__.encode())
        for entry in fields(light):
            digest.update(_bytes(getattr(light, entry.name)))
    emits = bake_scene.scene.emission.any(axis=1)
    digest.update(_bytes(bake_scene.scene.triangles[emits]))
    digest.update(_bytes(bake_scene.scene.emission[emits]))
    for entry in fields(settings):
        if entry.name not in _OF_NO_CONSEQUENCE:
            digest.update(f"{entry.name}={getattr(settings, entry.name)!r};".encode())
    return digest.hexdigest()


def _bytes(value: Any) -> bytes:
    if isinstance(value, str):
        return value.encode()
    return np.round(np.asarray(value, dtype=np.float64), 5).astype(np.float32).tobytes()
