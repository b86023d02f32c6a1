"""Baked objects show base color × lightmap, on copies, for every quantity."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.bake_scene import BakedObject, BakeResult, LightmapPage
from radiosity_addon.blender import bake_record
from radiosity_addon.blender.apply import apply_lightmaps, check_targets
from radiosity_addon.blender.export import export_scene
from radiosity_addon.blender.images import write_pages
from radiosity_addon.blender.lightmap_materials import set_lightmap_only
from radiosity_addon.blender.node_group import GROUP_NAME
from radiosity_addon.errors import BakeError, SceneError
from radiosity_addon.settings import BakeSettings
from tests.blender.file_dump import differences, dump_file
from tests.blender.hand_bake import hand_result
from tests.blender.zoo import build_zoo

TEXEL = (0.25, 0.5, 3.0)
BASE = (0.5, 0.25, 0.75)


@pytest.fixture(autouse=True)
def record() -> Iterator[None]:
    """The record's type, without the rest of the add-on."""
    if hasattr(bpy.types.Object, "radiosity_bake"):
        yield
        return
    bake_record.register()
    yield
    bake_record.unregister()


def _bake(
    colors: Sequence[Sequence[float]] = (TEXEL,), folder: Path | None = None, **settings: object
) -> BakeResult:
    wanted = BakeSettings(**settings)
    export = export_scene(bpy.context, wanted)
    result = hand_result(export, colors)
    apply_lightmaps(bpy.context, export, result, write_pages(result, wanted, folder), wanted)
    return result


def _plane(name: str = "Plane", material: bpy.types.Material | None = None) -> bpy.types.Object:
    """A square of side 2 that faces up."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    if material is not None:
        mesh.materials.append(material)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def _material(*, name: str = "Paint", **inputs: object) -> bpy.types.Material:
    """A Principled material; keywords are its inputs, with _ for a space."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    principled = material.node_tree.nodes["Principled BSDF"]
    principled.inputs["Base Color"].default_value = (*BASE, 1.0)
    for key, value in inputs.items():
        principled.inputs[key.replace("_", " ")].default_value = value
    return material


def _shader(material: bpy.types.Material, kind: str, **inputs: object) -> bpy.types.Node:
    node = material.node_tree.nodes.new(f"ShaderNode{kind}")
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    return node


def _surface(material: bpy.types.Material, socket: bpy.types.NodeSocket) -> None:
    tree = material.node_tree
    tree.links.new(socket, tree.nodes["Material Output"].inputs["Surface"])


def _seen(folder: Path, size: int = 2, engine: str = "CYCLES") -> np.ndarray:
    """Render the square [-1, 1]² from above: (size, size, 3) radiance, bottom row first."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    camera.location.z = 5.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = engine
    scene.cycles.samples, scene.cycles.use_denoising = 16, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    if hasattr(scene.render.image_settings, "media_type"):
        scene.render.image_settings.media_type = "IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(folder / "seen.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = "Non-Color"
    return np.array(image.pixels[:]).reshape(size, size, -1)[..., :3]


@pytest.mark.parametrize("file_format", ["exr", "png16"])
@pytest.mark.parametrize(
    ("quantity", "expected"),
    [
        ("irradiance_over_pi", np.multiply(BASE, TEXEL) + 0.5),
        ("irradiance", np.multiply(BASE, TEXEL) / math.pi + 0.5),
        ("radiosity", np.divide(TEXEL, math.pi)),
    ],
)
def test_radiance_is_right_for_each_quantity(
    tmp_path: Path, quantity: str, expected: np.ndarray, file_format: str
) -> None:
    _plane(material=_material(Emission_Color=(0.25, 0.25, 0.25, 1.0), Emission_Strength=2.0))
    _bake(quantity=quantity, format=file_format, folder=tmp_path)
    np.testing.assert_allclose(_seen(tmp_path)[0, 0], expected, rtol=1e-4)


@pytest.mark.parametrize(
    ("quantity", "factor"),
    [("irradiance_over_pi", 1), ("irradiance", 1 / math.pi), ("radiosity", 1 / math.pi)],
)
def test_lightmap_only_shows_what_a_white_surface_would(tmp_path: Path, quantity: str, factor: float) -> None:
    _plane(material=_material(Emission_Color=(1.0, 1.0, 1.0, 1.0), Emission_Strength=2.0))
    _bake(quantity=quantity)
    assert set_lightmap_only(True) == 1
    np.testing.assert_allclose(_seen(tmp_path)[0, 0], np.multiply(TEXEL, factor), rtol=1e-4)


def test_the_lightmap_lies_the_right_way_up(tmp_path: Path) -> None:
    """Row 0 of a page is v = 0; the square's UVs are its x and y."""
    plane = _plane()
    settings = BakeSettings()
    export = export_scene(bpy.context, settings)
    target = export.bake_scene.objects[0]
    corners = np.array([v.co[:2] for v in plane.data.vertices])
    vertex = np.array([loop.vertex_index for loop in plane.data.loops])
    uv = ((corners[vertex[target.loops]] + 1) / 2).astype(np.float32)
    pixels = np.zeros((2, 2, 3), np.float32)
    pixels[0, 0], pixels[0, 1], pixels[1, 0], pixels[1, 1] = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)
    page = LightmapPage(pixels, np.ones((2, 2), bool))
    result = BakeResult((page,), (BakedObject(target, uv, 0),), {}, ())
    apply_lightmaps(bpy.context, export, result, write_pages(result, settings, tmp_path), settings)
    seen = _seen(tmp_path, 4)
    # The outer quarter of each half reads its texel alone; inwards it is filtered.
    for row in (0, 1):
        for column in (0, 1):
            np.testing.assert_allclose(seen[3 * row, 3 * column], 0.8 * pixels[row, column], atol=1e-4)


def test_every_way_to_say_base_color_is_read(tmp_path: Path) -> None:
    """Diffuse in a node group, mixed half and half with another, plus an emission."""
    material = _material()
    nodes, links = material.node_tree.nodes, material.node_tree.links
    group = bpy.data.node_groups.new("Wrapped", "ShaderNodeTree")
    group.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    given, result = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    diffuse = group.nodes.new("ShaderNodeBsdfDiffuse")
    group.links.new(given.outputs["Tint"], diffuse.inputs["Color"])
    group.links.new(diffuse.outputs["BSDF"], result.inputs["Shader"])
    wrapped = nodes.new("ShaderNodeGroup")
    wrapped.node_tree = group
    wrapped.inputs["Tint"].default_value = (0.1, 0.2, 0.3, 1.0)
    mix = _shader(material, "MixShader", Fac=0.25)
    links.new(nodes["Principled BSDF"].outputs[0], mix.inputs[1])
    links.new(wrapped.outputs["Shader"], mix.inputs[2])
    emission = _shader(material, "Emission", Color=(1.0, 0.0, 0.5, 1.0), Strength=2.0)
    add = nodes.new("ShaderNodeAddShader")
    links.new(mix.outputs[0], add.inputs[0])
    links.new(emission.outputs[0], add.inputs[1])
    _surface(material, add.outputs[0])
    _plane(material=material)
    _bake()
    base = 0.75 * np.array(BASE) + 0.25 * np.array((0.1, 0.2, 0.3))
    np.testing.assert_allclose(_seen(tmp_path)[0, 0], base * TEXEL + (2.0, 0.0, 1.0), rtol=1e-4)


def test_textures_keep_feeding_base_color_and_emission(tmp_path: Path) -> None:
    material = _material(Emission_Strength=0.5)
    rgb = material.node_tree.nodes.new("ShaderNodeRGB")
    rgb.outputs[0].default_value = (0.3, 0.6, 0.9, 1.0)
    reroute = material.node_tree.nodes.new("NodeReroute")
    material.node_tree.links.new(rgb.outputs[0], reroute.inputs[0])
    principled = material.node_tree.nodes["Principled BSDF"]
    for name in ("Base Color", "Emission Color"):
        material.node_tree.links.new(reroute.outputs[0], principled.inputs[name])
    _plane(material=material)
    _bake()
    color = np.array((0.3, 0.6, 0.9))
    np.testing.assert_allclose(_seen(tmp_path)[0, 0], color * TEXEL + 0.5 * color, rtol=1e-4)


def test_transparency_is_kept(tmp_path: Path) -> None:
    """Half of what is behind shows through: a second plane that emits."""
    _plane(material=_material(Alpha=0.5))
    behind = _plane("Behind", _material(name="Glow", Emission_Color=(1, 1, 1, 1), Emission_Strength=1.0))
    behind.location.z = -1.0
    _bake()
    expected = 0.5 * np.multiply(BASE, TEXEL) + 0.5 * (np.multiply(BASE, TEXEL) + 1.0)
    # Stochastic in alpha: one of two surfaces a sample, so only their mean is sharp.
    seen = _seen(tmp_path, 16).mean(axis=(0, 1))
    np.testing.assert_allclose(seen, expected, rtol=0.03)


def test_a_mesh_without_material_is_grey(tmp_path: Path) -> None:
    plane = _plane()
    _bake()
    assert [material.name for material in plane.data.materials] == ["No Material (Lightmap)"]
    np.testing.assert_allclose(_seen(tmp_path)[0, 0], 0.8 * np.array(TEXEL), rtol=1e-4)


def test_an_object_without_uvs_keeps_its_textures_in_place(tmp_path: Path) -> None:
    """An image without a vector read (0, 0, 0) before, and does after; the group's image too."""
    build = bpy.data.images.new("Corners", 2, 2)
    build.pixels[:] = [0.25, 0.5, 1, 1, 1, 0, 0, 1, 0, 1, 0, 1, 1, 1, 1, 1]
    build.colorspace_settings.name = "Non-Color"
    build.pixels[:] = [0.25, 0.5, 1, 1, 1, 0, 0, 1, 0, 1, 0, 1, 1, 1, 1, 1]
    build.pack()
    material = _material()
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation, texture.extension = build, "Closest", "EXTEND"
    emission, group_user = _shader(material, "Emission"), tree.nodes.new("ShaderNodeGroup")
    tree.links.new(texture.outputs["Color"], emission.inputs["Color"])
    _surface(material, emission.outputs[0])
    group = bpy.data.node_groups.new("Coordinates", "ShaderNodeTree")
    group.interface.new_socket("UV", in_out="OUTPUT", socket_type="NodeSocketVector")
    coordinates, result = group.nodes.new("ShaderNodeTexCoord"), group.nodes.new("NodeGroupOutput")
    group.links.new(coordinates.outputs["UV"], result.inputs[0])
    group_user.node_tree = group
    plane = _plane(material=material)
    before = _seen(tmp_path, 4)

    for through_group in (False, True):
        if through_group:
            tree.links.new(group_user.outputs[0], texture.inputs["Vector"])
        _bake(colors=((0.0, 0.0, 0.0),))
        np.testing.assert_allclose(_seen(tmp_path, 4), before, atol=1e-5)
        from radiosity_addon.blender.restore import restore

        restore(bpy.context)
    assert np.ptp(before, axis=(0, 1)).max() == 0.0
    assert len(plane.data.uv_layers) == 0


def test_uv_layers_keep_names_order_and_roles() -> None:
    plane = _plane()
    for name in ("A", "B"):
        plane.data.uv_layers.new(name=name)
    plane.data.uv_layers["B"].active_render = True
    plane.data.uv_layers.active = plane.data.uv_layers["A"]
    original = plane.data
    result = _bake()
    layers = plane.data.uv_layers
    assert [(layer.name, layer.active, layer.active_render) for layer in layers] == [
        ("A", True, False),
        ("B", False, True),
        ("Lightmap", False, False),
    ]
    assert [layer.name for layer in original.uv_layers] == ["A", "B"]
    (baked,) = result.objects
    uv = np.empty(8, np.float32)
    plane.data.attributes["Lightmap"].data.foreach_get("vector", uv)
    written = dict(zip(baked.object.loops.ravel().tolist(), baked.uv.reshape(-1, 2).tolist(), strict=True))
    assert uv.reshape(-1, 2).tolist() == [written[loop] for loop in range(4)]


def test_polygons_loops_and_slots_stay_without_generative_modifiers() -> None:
    build_zoo(bpy.context)
    cube = bpy.data.objects["Cube"]
    before = [(p.loop_start, p.loop_total, p.material_index, tuple(p.vertices)) for p in cube.data.polygons]
    _bake()
    after = [(p.loop_start, p.loop_total, p.material_index, tuple(p.vertices)) for p in cube.data.polygons]
    assert after == before
    assert len(cube.data.materials) == 3
    assert all(material.name.endswith("(Lightmap)") for material in cube.data.materials)


def test_linked_duplicates_and_shared_materials_do_not_get_each_other_s_lightmaps(tmp_path: Path) -> None:
    material = _material()
    first = _plane("First", material)
    second = bpy.data.objects.new("Second", first.data)
    third = _plane("Third", material)
    bpy.context.scene.collection.objects.link(second)
    result = _bake(colors=((1, 0, 0), (0, 1, 0)), folder=tmp_path)
    objects = [bpy.data.objects[baked.object.name] for baked in result.objects]
    assert len({obj.data for obj in (first, second, third)}) == 3

    def image(obj: bpy.types.Object) -> str:
        return next(
            n.image.name for n in obj.data.materials[0].node_tree.nodes if n.type == "TEX_IMAGE" and n.image
        )

    # Two pages dealt in turn: the first and last object share a page, hence a material.
    assert [image(obj) for obj in objects] == ["lightmap.exr", "lightmap_2.exr", "lightmap.exr"]
    shown = [obj.data.materials[0] for obj in objects]
    assert shown[0] == shown[2] != shown[1]
    assert sum(tree.name.startswith(GROUP_NAME) for tree in bpy.data.node_groups) == 1


def test_materials_linked_to_the_object_are_the_ones_copied() -> None:
    build_zoo(bpy.context)
    _bake()
    names = [slot.material.name for slot in bpy.data.objects["Duplicate"].material_slots]
    assert names[0] == "Of the Object (Lightmap)"
    assert {slot.link for slot in bpy.data.objects["Duplicate"].material_slots} == {"DATA"}


def test_stand_ins_stand_where_the_instances_were(tmp_path: Path) -> None:
    """World-space corners of all that is rendered, before and after, sheared instances included."""
    build_zoo(bpy.context)
    export = export_scene(bpy.context, BakeSettings())
    before = export.bake_scene.scene
    _bake(folder=tmp_path)
    after = export_scene(bpy.context, BakeSettings()).bake_scene.scene

    def soup(scene: object) -> np.ndarray:
        """Corners in an order that does not depend on the objects', winding kept."""
        corners = scene.triangles.round(3) + 0.0
        first = np.array([min(range(3), key=lambda i: tuple(t[i])) for t in corners])
        rolled = [np.roll(t, -i, axis=0).ravel() for t, i in zip(corners, first, strict=True)]
        return np.array(rolled)[np.lexsort(np.array(rolled).T)]

    np.testing.assert_allclose(soup(after), soup(before), atol=2e-3)
    stand_ins = bpy.data.collections["Radiosity Lightmaps"].objects
    assert len(stand_ins) > 10
    assert all(stand_in.data.users == 1 for stand_in in stand_ins)
    assert bpy.data.objects["Instancer 0"].hide_render


def test_an_instancer_s_other_instances_stay_visible() -> None:
    """Only one of its two objects is baked, yet hiding the instancer must not lose the other."""
    build_zoo(bpy.context)
    settings = BakeSettings(objects=("Instancer 0/Leaf",))
    export = export_scene(bpy.context, settings)
    result = hand_result(export)
    apply_lightmaps(bpy.context, export, result, write_pages(result, settings, None), settings)
    names = {obj.name for obj in bpy.data.collections["Radiosity Lightmaps"].objects}
    assert names == {"Instancer 0/Leaf (Lightmap)", "Instancer 0/Branch (Lightmap)"}
    unbaked = bpy.data.objects["Instancer 0/Branch (Lightmap)"].data
    assert "Lightmap" not in unbaked.uv_layers
    assert [material.name for material in unbaked.materials] == ["Brick"]
    assert not bpy.data.objects["Instancer 1"].hide_render


def test_modifiers_that_made_the_mesh_are_off() -> None:
    build_zoo(bpy.context)
    _bake()
    modified = bpy.data.objects["Modified"]
    assert len(modified.data.polygons) > 6
    assert not any(modifier.show_viewport or modifier.show_render for modifier in modified.modifiers)


def test_a_ninth_layer_is_refused_before_anything_changes() -> None:
    settings = BakeSettings()
    full = _plane("Full of UVs")
    for i in range(8):
        full.data.uv_layers.new(name=f"UV {i}")
    _plane("Other")
    full.hide_render = True
    export_without = export_scene(bpy.context, settings)
    full.hide_render = False
    with pytest.raises(SceneError, match="Full of UVs"):
        export_scene(bpy.context, settings)

    # The layers may also have come since the export.
    full.data.uv_layers.remove(full.data.uv_layers[7])
    full.data.update()
    export = export_scene(bpy.context, settings)
    full.data.uv_layers.new(name="UV 7")
    result = hand_result(export)
    images = write_pages(result, settings, None)
    dump_file()
    before = dump_file()
    with pytest.raises(SceneError, match="Full of UVs"):
        check_targets(export)
    with pytest.raises(SceneError, match="Full of UVs"):
        apply_lightmaps(bpy.context, export, result, images, settings)
    assert differences(before, dump_file()) == []
    assert len(export_without.sources) == 1


def test_an_attribute_called_lightmap_is_refused() -> None:
    _plane().data.attributes.new("Lightmap", "FLOAT", "POINT")
    with pytest.raises(SceneError, match="'Plane' has an attribute 'Lightmap'"):
        check_targets(export_scene(bpy.context, BakeSettings()))


def test_an_object_that_went_away_is_named_and_nothing_changes() -> None:
    _plane("Stays")
    leaves = _plane("Leaves")
    settings = BakeSettings()
    export = export_scene(bpy.context, settings)
    result = hand_result(export)
    bpy.data.objects.remove(leaves)
    images = write_pages(result, settings, None)
    dump_file()
    before = dump_file()
    with pytest.raises(BakeError, match="'Leaves' went away"):
        apply_lightmaps(bpy.context, export, result, images, settings)
    assert differences(before, dump_file()) == []


def test_a_mesh_that_changed_is_named() -> None:
    plane = _plane()
    settings = BakeSettings()
    export = export_scene(bpy.context, settings)
    target = export.bake_scene.objects[0]
    result = hand_result(export)
    result = replace(result, objects=(replace(result.objects[0], object=target),))
    plane.data.clear_geometry()
    with pytest.raises(BakeError, match="'Plane' changed while"):
        apply_lightmaps(bpy.context, export, result, write_pages(result, settings, None), settings)


def test_a_second_bake_on_top_of_the_first_is_refused() -> None:
    _plane()
    _bake()
    with pytest.raises(BakeError, match="restore it"):
        _bake()


def test_one_undo_step_takes_the_bake_back() -> None:
    plane = _plane()
    bpy.ops.ed.undo_push(message="before")
    name = plane.data.name
    _bake()
    bpy.ops.ed.undo_push(message="bake")
    bpy.ops.ed.undo()
    assert bpy.data.objects["Plane"].data.name == name
    assert not bake_record.is_baked()
