"""What objects and scene remember of their lightmaps, by which the next bake is planned (`bake/plan.py`)."""

from __future__ import annotations

import json

import bpy

from ...bake import SHORT, BakeDigests, RememberedLightmap, ShownBake
from ...bake.result import BakeResult
from ...bake.scene_diff import LightSummary, as_light_summaries, light_summaries
from ...options import BakeSettings
from ..datablocks.bake_record import shows_lightmap
from ..scene_records.export_sources import Export
from .content_digest import content_digest
from .scopes import files_of

_READ_BY = ("resolution", "ignore", "light_only", "sky")
"""Settings by which a scene is read: what a bake reads of it differs with them."""


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
    scene: bpy.types.Scene,
    export: Export,
    result: BakeResult,
    digests: BakeDigests,
    settings: BakeSettings,
    *,
    is_partial: bool = False,
) -> None:
    """Note on every object what it was baked as, and on the scene which objects and lights there were.

    is_partial: Whether objects keep earlier lightmaps, which show the lights of before.
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
    if is_partial and scene.radiosity.baked_lights:
        return
    read_by = {name: getattr(settings, name) for name in _READ_BY}
    lights = light_summaries(export.bake_scene)
    scene.radiosity.baked_lights = json.dumps({"settings": read_by, "lights": lights})


def remember_content(scene: bpy.types.Scene) -> None:
    """Note what the file holds now: as long as it does, nothing was edited since the scene was baked."""
    scene.radiosity.baked_content = content_digest() or ""


def forget_content(scene: bpy.types.Scene) -> None:
    """Note that the scene must be compared with its bake."""
    scene.radiosity.property_unset("baked_content")


def is_as_remembered(scene: bpy.types.Scene) -> bool:
    """Return whether the file holds what it held when it was last known that nothing was edited."""
    content = scene.radiosity.baked_content
    return bool(content) and content_digest() == content


def baked_lights(scene: bpy.types.Scene) -> tuple[BakeSettings, dict[str, LightSummary]] | None:
    """Return the settings by which a scene was read for its bake, and the lights that it had.

    Returns None if a bake of an earlier version does not say.
    """
    try:
        known = json.loads(scene.radiosity.baked_lights)
        read_by = known["settings"]
        for name in ("ignore", "light_only"):  # what is gone would be refused
            read_by[name] = tuple(each for each in read_by[name] if each in scene.objects)
        return BakeSettings(**read_by), as_light_summaries(known["lights"])
    except (ValueError, TypeError, KeyError):
        return None
