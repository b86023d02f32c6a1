"""Settings of scene and view layer that change what light there is in a render."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import bpy

from ...base import BakeWarning

_USUAL_SPACE = "Linear Rec.709"


def world_of(context: bpy.types.Context) -> bpy.types.World | None:
    """Return the world that a render of the view layer shows; None where it shows none."""
    layer = context.view_layer
    if not layer.use_sky:
        return None
    return getattr(layer, "world_override", None) or context.scene.world


def option_warnings(context: bpy.types.Context) -> list[BakeWarning]:
    """Say which settings of a render a bake does not follow.

    Call it while the scene is shown as a render would (`render_depsgraph`).
    """
    scene, layer = context.scene, context.view_layer
    messages = []
    cycles = getattr(scene, "cycles", None)
    if getattr(cycles, "use_fast_gi", False):
        messages.append("Fast GI Approximation is ignored: all bounces are followed")
    warnings = [BakeWarning(scene.name, f"scene '{scene.name}': {message}") for message in messages]
    objects = [obj for obj in layer.objects if not obj.hide_render]
    if scene.render.use_simplify:
        warnings += _culled(cycles, objects)
    space = getattr(getattr(bpy.data, "colorspace", None), "working_space", _USUAL_SPACE)
    if space != _USUAL_SPACE:
        message = f"the file's working space is {space}: its lightmaps hold such colors, not {_USUAL_SPACE}"
        warnings.append(BakeWarning(scene.name, message))
    return [*warnings, *_missing_links(), *_still_as_in_the_viewport(objects)]


def _missing_links() -> Iterator[BakeWarning]:
    """Warn of libraries that linked data-blocks cannot be loaded from: empty ones stand for them."""
    missing: dict[str, list[str]] = {}
    data = bpy.data
    for blocks in (data.objects, data.collections, data.meshes, data.lights, data.materials, data.worlds):
        for block in blocks:
            if block.is_missing and block.library is not None:
                missing.setdefault(block.library.filepath, []).append(block.name)
    for path, names in missing.items():
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        message = (
            f"library '{path}' has no '{names[0]}'{more}: objects linked from it are left out; relink it"
        )
        yield BakeWarning(path, message)


def _culled(cycles: object, objects: Iterable[bpy.types.Object]) -> Iterator[BakeWarning]:
    """Warn of objects that Cycles leaves out where the camera does not see them."""
    for by in ("use_camera_cull", "use_distance_cull"):
        if not getattr(cycles, by, False):
            continue
        for obj in objects:
            if getattr(obj.cycles, by, False):
                message = f"object '{obj.name}': culling is ignored: it lights and blocks out of view too"
                yield BakeWarning(obj.name, message)


def _still_as_in_the_viewport(objects: Iterable[bpy.types.Object]) -> Iterator[BakeWarning]:
    """Warn of what a render would show otherwise, and only a render."""
    known: dict[str, bool] = {}
    for obj in objects:
        if obj.hide_viewport:
            message = "its viewport visibility is driven, and used for renders too"
            yield BakeWarning(obj.name, f"object '{obj.name}': {message}")
        for modifier in obj.modifiers:
            if modifier.show_viewport != modifier.show_render:
                message = f"modifier '{modifier.name}' is driven in viewports, and used as there"
                yield BakeWarning(obj.name, f"object '{obj.name}': {message}")
            if modifier.type == "NODES" and modifier.show_render and _asks(modifier.node_group, known):
                message = "its geometry nodes use 'Is Viewport', which is on in an export; renders may differ"
                yield BakeWarning(obj.name, f"object '{obj.name}': {message}")


def _asks(tree: bpy.types.NodeTree | None, known: dict[str, bool]) -> bool:
    """Return whether a node tree, or a group in it, asks if it is evaluated for the viewport."""
    if tree is None:
        return False
    if tree.name_full not in known:
        known[tree.name_full] = False  # while its groups are searched
        groups = [node.node_tree for node in tree.nodes if node.type == "GROUP"]
        itself = any(node.bl_idname == "GeometryNodeIsViewport" for node in tree.nodes)
        known[tree.name_full] = itself or any(_asks(group, known) for group in groups)
    return known[tree.name_full]
