"""Which objects keep the lightmaps they show when others get new ones."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from pathlib import Path

import bpy

from ...base import BakeWarning
from ...files import folded
from ..datablocks.bake_record import ASIDE, is_made, is_recorded, made_datablocks, recorded_objects
from ..scene_records.export_sources import Export
from ..stand_ins.replacements import shown_by
from ..stand_ins.stand_ins import INSTANCER


def shown_again(export: Export) -> set[str]:
    """Return the names of the objects that will show something else once the export is baked."""
    levels = {item.name for item in export.bake_scene.levels}
    pairs = zip(export.sources, export.bake_scene.objects, strict=True)
    return {shown_by(source) for source, target in pairs if target.bake or target.name in levels}


def keeping_theirs(scene: bpy.types.Scene, export: Export, is_partial: bool) -> frozenset[str]:
    """Return the names of the objects that keep the lightmaps of earlier bakes.

    scene: The one that is baked.
    is_partial: Only some objects of the scene are baked; otherwise other scenes' objects keep theirs.
    """
    updated = shown_again(export)
    return frozenset(
        obj.name
        for obj in recorded_objects()
        if obj.name not in updated and (is_partial or not _belongs_to(obj, scene))
    )


def of_scene(names: Collection[str], scene: bpy.types.Scene) -> list[str]:
    """Return those of some objects that show a lightmap of this scene."""
    objects = [bpy.data.objects[name, None] for name in sorted(names)]
    return [obj.name for obj in objects if _belongs_to(obj, scene)]


def shared_warnings(scene: bpy.types.Scene, export: Export) -> tuple[BakeWarning, ...]:
    """Warn of objects that show another scene's lightmap, in whose place this bake's comes."""
    found = []
    for name in sorted(shown_again(export)):
        obj = bpy.data.objects.get((name, None))
        other = None if obj is None else scene_of(obj)
        if other is not None and other != scene:
            message = f"object '{name}' is in scene '{other.name}' too, and shows this bake's lightmap there"
            found.append(BakeWarning(name, message))
    return tuple(found)


def files_shown_by(names: Collection[str], others: Iterable[bpy.types.Object] = ()) -> frozenset[str]:
    """Return the stems of the files, `folded`, of the lightmaps that objects or their instances show."""
    objects = [obj for name in names if (obj := bpy.data.objects.get((name, None))) is not None]
    inside = set(objects)
    objects += others
    objects += [
        block
        for block in made_datablocks()
        if isinstance(block, bpy.types.Object) and block.get(INSTANCER) in inside
    ]
    return frozenset().union(*(files_of(obj) for obj in objects))


def files_of(obj: bpy.types.Object) -> frozenset[str]:
    """Return the stems of the files, `folded`, of the lightmaps that an object shows."""
    found = set()
    materials = [slot.material for slot in obj.material_slots]
    trees = [material.node_tree for material in materials if material is not None and is_made(material)]
    while trees:
        tree = trees.pop()
        for node in tree.nodes if tree is not None else ():
            if node.type == "GROUP" and node.node_tree is not None and is_made(node.node_tree):
                trees.append(node.node_tree)
            elif node.type == "TEX_IMAGE" and node.image is not None and is_made(node.image):
                name = node.image.filepath_raw or node.image.name.removeprefix(ASIDE)
                found.add(folded(Path(name).stem))
    return frozenset(found)


def _belongs_to(obj: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """Whether an object shows a lightmap of this scene's bake, or of none that is known."""
    baked_in = scene_of(obj)
    scenes = obj.users_scene
    return baked_in == scene if baked_in is not None else (scene in scenes or not scenes)


def scene_of(obj: bpy.types.Object) -> bpy.types.Scene | None:
    """Return the scene whose bake an object shows; None where that is gone or not known."""
    name = obj.radiosity_bake.scene if is_recorded(obj) else ""
    scene = bpy.data.scenes.get(name) if name else None
    behind = [] if scene is None else [scene.background_set]
    known = scene is not None and (scene in obj.users_scene or any(b in obj.users_scene for b in behind if b))
    return scene if known else None
