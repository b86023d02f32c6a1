"""What objects and scene remember of their lightmaps, by which the next bake is planned (`bake/plan.py`)."""

from __future__ import annotations

import json

import bpy

from ...bake import SHORT, BakeDigests, RememberedLightmap, ShownBake
from ...bake.result import BakeResult
from ..datablocks.bake_record import shows_lightmap
from ..scene_records.export_sources import Export
from .scopes import files_of


def shown_bake(scene: bpy.types.Scene, export: Export) -> ShownBake | None:
    """Return what is remembered of a scene's lightmaps; None if instances, which have no memory, get some."""
    lightmaps = {}
    for source, target in zip(export.sources, export.bake_scene.objects, strict=True):
        if not target.bake:
            continue
        if source.is_instance or source.makes_instances:
            return None
        obj = bpy.data.objects.get((source.object_name, None))
        if obj is None or not obj.is_property_set("radiosity_bake"):
            continue
        record, files = obj.radiosity_bake, files_of(obj)
        if record.scene in {"", scene.name} and record.is_baked and shows_lightmap(obj) and files:
            light = record.light or scene.radiosity.baked_light
            lightmap = RememberedLightmap(record.fingerprint, light, record.texels_per_metre, len(files) > 1)
            lightmaps[target.name] = lightmap
    return ShownBake(lightmaps, json.loads(scene.radiosity.baked_objects or "{}"))


def remember(
    scene: bpy.types.Scene, export: Export, result: BakeResult, digests: BakeDigests, resolution: int
) -> None:
    """Note on every object what it was baked as, and on the scene which objects there were.

    resolution: Of the bake's settings, by which textures are read.
    """
    sources = {
        target.name: source for source, target in zip(export.sources, export.bake_scene.objects, strict=True)
    }
    for baked in result.objects:
        source = sources[baked.object.name]
        obj = bpy.data.objects.get((source.object_name, None))
        if obj is None or source.is_instance or not obj.is_property_set("radiosity_bake"):
            continue
        obj.radiosity_bake.fingerprint = digests.objects[baked.object.name]
        page = result.atlas[baked.page] if result.atlas else {}
        obj.radiosity_bake.texels_per_metre = page.get("texels_per_metre", 0.0)
        obj.radiosity_bake.light = digests.light
    scene.radiosity.baked_light = digests.light
    short = {name: digest[:SHORT] for name, digest in digests.objects.items()}
    scene.radiosity.baked_objects = json.dumps(short)
    scene.radiosity.baked_resolution = resolution
