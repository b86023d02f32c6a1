"""See the scene as a render would, through the viewport's dependency graph.

Python can only reach the graph that the viewport evaluates: objects hidden there are not
in it, and modifiers run at viewport levels. A graph in render mode exists only inside a
render engine. So everything with a viewport and a render setting is switched to the render's
for a moment, and put back after.

What this does not see: the *Is Viewport* node of geometry nodes, and settings that an
action or a driver animates, which win over what is switched here.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import bpy

_MODIFIER_PAIRS = {  # modifier type → (viewport attribute, render attribute)
    "SUBSURF": ("levels", "render_levels"),
    "MULTIRES": ("levels", "render_levels"),
    "SCREW": ("steps", "render_steps"),
    "OCEAN": ("viewport_resolution", "resolution"),
}
_SIMPLIFY_PAIRS = (
    ("simplify_subdivision", "simplify_subdivision_render"),
    ("simplify_child_particles", "simplify_child_particles_render"),
)


def leave_edit_mode(context: bpy.types.Context) -> None:
    """Flush every mesh in edit mode: its edits are not in the mesh before it is left."""
    context.view_layer.update()  # or removed objects are still listed, as None
    editing = [obj for obj in context.view_layer.objects if obj.mode == "EDIT"]
    if editing and bpy.ops.object.mode_set.poll():
        bpy.ops.object.mode_set(mode="OBJECT")
    for obj in editing:
        if obj.mode == "EDIT":
            obj.update_from_editmode()


@contextmanager
def render_depsgraph(context: bpy.types.Context) -> Iterator[bpy.types.Depsgraph]:
    """Evaluate the context's view layer as a render would; the scene is put back after.

    Yields the evaluated dependency graph, valid inside the `with` block only.
    """
    layer = context.view_layer
    layers = [layer, *(_render_layer(scene) for scene in background_scenes(context.scene))]
    selected = [
        (obj, view_layer)
        for view_layer in layers
        for obj in view_layer.objects
        if obj.select_get(view_layer=view_layer)
    ]
    active = [view_layer.objects.active for view_layer in layers]
    changes = _Changes()
    hidden = [
        (obj, view_layer)
        for view_layer in layers
        for obj in view_layer.objects
        if obj.hide_get(view_layer=view_layer)
    ]
    try:
        for obj, view_layer in hidden:
            obj.hide_set(False, view_layer=view_layer)
        _switch_visibility(layers, changes)
        _switch_levels(context.scene, changes)
        layer.update()
        yield context.evaluated_depsgraph_get()
    finally:
        changes.undo()
        layer.update()
        for obj, view_layer in hidden:
            obj.hide_set(True, view_layer=view_layer)
        # Hiding an object deselects it, so this comes last.
        for view_layer, was_active in zip(layers, active, strict=True):
            view_layer.objects.active = was_active
        for obj, view_layer in selected:
            obj.select_set(True, view_layer=view_layer)


def background_scenes(scene: bpy.types.Scene) -> list[bpy.types.Scene]:
    """Return the scenes a render shows behind a scene: its background set, that one's, and so on."""
    behind: list[bpy.types.Scene] = []
    while scene.background_set is not None and scene.background_set not in behind:
        scene = scene.background_set
        behind.append(scene)
    return behind


def _render_layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """Return the view layer that shows where a scene is the background of another."""
    return next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])


class _Changes:
    """Attributes that were switched, and what they were."""

    def __init__(self) -> None:
        self._before: list[tuple[Any, str, Any]] = []

    def set(self, owner: Any, attribute: str, value: Any) -> None:
        before = getattr(owner, attribute)
        if before != value:
            self._before.append((owner, attribute, before))
            setattr(owner, attribute, value)

    def undo(self) -> None:
        for owner, attribute, before in reversed(self._before):
            setattr(owner, attribute, before)


def _switch_visibility(layers: Sequence[bpy.types.ViewLayer], changes: _Changes) -> None:
    for obj in bpy.data.objects:
        changes.set(obj, "hide_viewport", obj.hide_render)
        changes.set(obj, "show_instancer_for_viewport", obj.show_instancer_for_render)
    for collection in bpy.data.collections:
        changes.set(collection, "hide_viewport", collection.hide_render)
    for layer in layers:
        for child in _layer_collections(layer.layer_collection):
            changes.set(child, "hide_viewport", False)


def _layer_collections(root: bpy.types.LayerCollection) -> Iterator[bpy.types.LayerCollection]:
    for child in root.children:
        yield child
        yield from _layer_collections(child)


def _switch_levels(scene: bpy.types.Scene, changes: _Changes) -> None:
    for obj in bpy.data.objects:
        for modifier in obj.modifiers:
            changes.set(modifier, "show_viewport", modifier.show_render)
            if modifier.type in _MODIFIER_PAIRS:
                viewport, render = _MODIFIER_PAIRS[modifier.type]
                changes.set(modifier, viewport, getattr(modifier, render))
    for curve in bpy.data.curves:
        for axis in "uv":
            if getattr(curve, f"render_resolution_{axis}") > 0:  # 0: the viewport's
                changes.set(curve, f"resolution_{axis}", getattr(curve, f"render_resolution_{axis}"))
    for metaball in bpy.data.metaballs:
        changes.set(metaball, "resolution", metaball.render_resolution)
    for particles in bpy.data.particles:
        changes.set(particles, "display_percentage", 100)
    for viewport, render in _SIMPLIFY_PAIRS if scene.render.use_simplify else ():
        changes.set(scene.render, viewport, getattr(scene.render, render))
