"""What a render shows is what the export sees, and looking leaves the scene as it was."""

from __future__ import annotations

import math
from typing import ClassVar

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import SceneError
from radiosity_addon.blender.scene_records.render_state import render_depsgraph
from radiosity_addon.blender.scene_records.scene_objects import visible_objects
from tests.blender.exporting import add_cube, add_instance, export_with, objects_by_name, scatter_nodes
from tests.blender.scenes import add_mesh, add_object, shader_material


def test_what_a_render_shows_is_exported_and_nothing_else_and_the_scene_is_left_as_it_was() -> None:
    scene, layer = bpy.context.scene, bpy.context.view_layer
    objects = {name: add_cube(name) for name in ("Plain", "Monitor", "Eye", "NoRender")}
    objects["Monitor"].hide_viewport = True
    objects["Eye"].hide_set(True)
    objects["NoRender"].hide_render = True
    for name in ("ColMonitor", "ColEye", "ColNoRender", "ColExcluded"):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        objects[f"In{name}"] = add_cube(f"In{name}", collection=collection)
    bpy.data.collections["ColMonitor"].hide_viewport = True
    bpy.data.collections["ColNoRender"].hide_render = True
    layer.layer_collection.children["ColEye"].hide_viewport = True
    layer.layer_collection.children["ColExcluded"].exclude = True
    layer.update()
    objects["NoRender"].select_set(True)
    objects["Plain"].select_set(True)
    layer.objects.active = objects["NoRender"]

    def state() -> list:
        return [
            [(o.name, o.hide_viewport, o.hide_render, o.select_get(), o.hide_get()) for o in layer.objects],
            [(c.name, c.hide_viewport, c.hide_render) for c in bpy.data.collections],
            [(c.name, c.hide_viewport, c.exclude) for c in layer.layer_collection.children],
            layer.objects.active.name,
        ]

    before = state()
    export = export_with()
    assert sorted(objects_by_name(export)) == ["Eye", "InColEye", "InColMonitor", "Monitor", "Plain"]
    assert all(obj.bake for obj in export.bake_scene.objects)
    assert state() == before


def test_a_view_layers_material_override_counts() -> None:
    add_mesh("Floor", material=shader_material("Red", "ShaderNodeBsdfDiffuse", Color=(1, 0, 0, 1)))
    override = shader_material("Clay", "ShaderNodeBsdfDiffuse", Color=(0.25, 0.5, 0.75, 1))
    bpy.context.view_layer.material_override = override
    np.testing.assert_allclose(export_with().bake_scene.scene.reflectance, [(0.25, 0.5, 0.75)] * 2, rtol=1e-6)


def test_the_scene_is_put_back_when_the_export_fails() -> None:
    add_cube("NoRender").hide_render = True
    with pytest.raises(SceneError, match="nothing to bake"):
        export_with()
    assert not bpy.data.objects["NoRender"].hide_viewport


class _Listing(bpy.types.RenderEngine):
    """An engine that only notes what Blender hands it to render."""

    bl_idname = "RADIOSITY_TEST_LISTING"
    bl_label = "Listing"
    meshes: ClassVar[list[tuple]] = []

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        assert depsgraph.mode == "RENDER"
        _Listing.meshes = [_listed(instance) for instance in depsgraph.object_instances if _drawn(instance)]


def _drawn(instance: bpy.types.DepsgraphObjectInstance) -> bool:
    return instance.object.type == "MESH" and instance.show_self and len(instance.object.data.polygons) > 0


def _listed(instance: bpy.types.DepsgraphObjectInstance) -> tuple:
    mesh, matrix = instance.object.data, tuple(tuple(row) for row in instance.matrix_world)
    return instance.object.name, instance.is_instance, len(mesh.polygons), len(mesh.vertices), matrix


def test_the_export_sees_what_blender_hands_a_render_engine() -> None:
    """All at once: hiding of every kind, levels, instances, instancers that hide, curves."""
    scene = bpy.context.scene
    add_cube("Subdivided").modifiers.new("Subdivision", "SUBSURF").render_levels = 3
    screw = add_mesh("Screw", location=(9, 0, 0)).modifiers.new("Screw", "SCREW")
    screw.steps, screw.render_steps = 3, 7
    for name, attribute in (("ViewportOnly", "hide_render"), ("RenderOnly", "hide_viewport")):
        setattr(add_cube(name), attribute, True)
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        add_cube(f"In{name}", collection=collection)
        setattr(collection, attribute, True)
    group = bpy.data.collections.new("Group")
    add_cube("Shown", collection=group).hide_viewport = True
    add_cube("Hidden", collection=group).hide_render = True
    add_instance(group, "Instancer", location=(0, 0, 9)).hide_viewport = True
    faces = add_mesh("Faces")
    faces.instance_type, faces.show_instancer_for_render = "FACES", False
    add_cube("OnFaces").parent = faces
    add_mesh("Scattered").modifiers.new("Scatter", "NODES").node_group = scatter_nodes(None)
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.resolution_u, text.render_resolution_u = "O", 2, 6
    add_object("Text", text)
    scene.camera = add_object("Camera", bpy.data.cameras.new("Camera"))

    bpy.utils.register_class(_Listing)
    try:
        scene.render.engine = _Listing.bl_idname
        bpy.ops.render.render()
        scene.render.engine = "CYCLES"
    finally:
        bpy.utils.unregister_class(_Listing)
    with render_depsgraph(bpy.context) as depsgraph:
        seen = [_listed(instance) for instance in visible_objects(depsgraph) if _drawn(instance)]
    assert len(seen) > 10
    assert sorted(seen) == sorted(_Listing.meshes)


@pytest.mark.parametrize("kind", ["CURVE", "FONT", "META", "SURFACE"])
def test_curves_texts_metaballs_and_surfaces_are_baked_under_their_own_names(kind: str) -> None:
    add_mesh("Floor")
    if kind == "CURVE":
        data = bpy.data.curves.new("Other", "CURVE")
        data.splines.new("POLY").points.add(1)
        data.splines[0].points[1].co = (0, 0, 2, 1)
        data.dimensions, data.bevel_depth = "3D", 0.1
    elif kind == "FONT":
        data = bpy.data.curves.new("Other", "FONT")
        data.body = "A"
    elif kind == "META":
        data = bpy.data.metaballs.new("Other")
        data.elements.new()
    else:
        bpy.ops.surface.primitive_nurbs_surface_sphere_add()
        data = bpy.context.object.data
        bpy.data.objects.remove(bpy.context.object)
    data.materials.append(shader_material("Glow", "ShaderNodeEmission"))
    add_object("Other", data)
    export = export_with()
    floor, other = export.bake_scene.objects
    assert (floor.name, floor.bake) == ("Floor", True)
    assert (other.name, other.bake) == ("Other", True)
    assert other.count > 0
    np.testing.assert_allclose(export.bake_scene.scene.emission[other.rows], math.pi, rtol=1e-6)
    assert not any("lightmap" in warning.message for warning in export.bake_scene.warnings)


def test_what_cannot_be_read_is_named() -> None:
    tufted = add_cube("Tufted")
    tufted.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings.type = "HAIR"
    add_object("Fog", bpy.data.volumes.new("Fog"))
    export = export_with(sky=True)
    told = {warning.name: warning.message for warning in export.bake_scene.warnings}
    assert told.keys() == {"Tufted", "Fog"}
    assert "hair" in told["Tufted"]
    assert "volume" in told["Fog"]
    assert not export.sources[0].needs_evaluated_mesh
