"""What has a volume and no surface, such as a box of fog, is no wall."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from tests.blender.exporting import CUBE, CUBE_FACES, export_with, objects_by_name
from tests.blender.scenes import add_lamp, add_mesh, add_node, measure_irradiance, with_nodes
from tests.wording import says


def fog(density: float = 0.0) -> bpy.types.Material:
    material = bpy.data.materials.new("Fog")
    tree = with_nodes(material)
    scatter = add_node(tree, "ShaderNodeVolumeScatter", Density=density)
    tree.links.new(scatter.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
    return material


def fog_box(**transform: object) -> bpy.types.Object:
    box = add_mesh("Box", CUBE, CUBE_FACES, **transform)
    box.data.materials.append(fog())
    return box


def test_cycles_light_goes_through_a_volume_without_surface() -> None:
    meter = add_mesh("Meter")
    add_lamp("SUN", energy=2.0, angle=0.0)
    fog_box(location=(0, 0, 3), scale=(5, 5, 1))
    assert measure_irradiance(meter) == pytest.approx(2.0, rel=1e-3)


def test_a_box_of_fog_is_left_out_and_reported() -> None:
    add_mesh("Meter")
    add_lamp("SUN")
    fog_box()
    scene = export_with().bake_scene
    assert objects_by_name(export_with())["Box"].count == 0
    assert len(scene.scene) == 2
    (warning,) = [warning for warning in scene.warnings if warning.name == "Fog"]
    assert says(warning.message, "Fog", "volume", "ignored")


def test_fog_on_some_faces_lets_light_through_there() -> None:
    add_lamp("SUN")
    box = fog_box()
    box.data.materials.append(None)
    box.data.polygons[0].material_index = 1
    export = export_with()
    scene = export.bake_scene.scene
    assert objects_by_name(export)["Box"].count == 12
    assert scene.images is not None
    through = scene.images.textured
    polygon = objects_by_name(export)["Box"].polygon
    np.testing.assert_array_equal(through, polygon != 0)
