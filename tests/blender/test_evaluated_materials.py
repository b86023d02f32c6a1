"""Cycles evaluates materials on a mesh of its own: exactly, in one go, and without a trace."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.cycles import surface_bake
from radiosity_addon.blender.materials.gloss import Gloss
from radiosity_addon.blender.materials.materials import read_material
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.scene import Scene
from radiosity_addon.scene.textures import SurfaceImages
from tests.blender.exporting import CUBE, CUBE_FACES, add_cube, add_instance
from tests.blender.file_dump import differences_since, tidy_dump
from tests.blender.material_zoo import BLUE, RED, ZOO, cut_out, diffuse_of, feed, make_all_vary
from tests.blender.scenes import add_mesh, add_node, shader_material
from tests.blender.zoo import build_zoo


def _scene(resolution: int = 128) -> Scene:
    return export_scene(bpy.context, BakeSettings(resolution=resolution, sky=True)).bake_scene.scene


def _images(resolution: int = 128) -> SurfaceImages:
    images = _scene(resolution).images
    assert images is not None
    return images


@pytest.mark.parametrize(
    "gloss",
    [
        Gloss(),
        *(
            pytest.param(gloss, marks=pytest.mark.one_blender)
            for gloss in (Gloss(filtered=1.0), Gloss(reflective=False))
        ),
    ],
)
@pytest.mark.parametrize("kind", ZOO)
def test_evaluated_values_are_those_read_as_constants(kind: str, gloss: Gloss) -> None:
    cycles = bpy.context.scene.cycles
    cycles.caustics_reflective, cycles.blur_glossy = gloss.reflective, gloss.filtered
    assert Gloss.of(bpy.context.scene) == gloss
    material = ZOO[kind]()
    read = read_material(material, lets_through=True, gloss=gloss)
    assert not read.varies
    make_all_vary(material.node_tree)
    assert read_material(material, lets_through=True).varies
    add_mesh("Quad", material=material)
    images = _images()
    assert images.textured.all()
    row, column = (images.image_uv[0].mean(axis=0)[::-1] * images.values.shape[:2]).astype(int)
    value = images.values[row, column]
    np.testing.assert_allclose(value[:3], read.reflectance, atol=1e-5)
    np.testing.assert_allclose(value[3:6], read.emission, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(value[6], read.opacity, atol=1e-5)
    if read.passed is not None:
        assert images.passes is not None
        np.testing.assert_allclose(images.passes[row, column], read.passed, atol=1e-5)


def _square_uvs(obj: bpy.types.Object, name: str = "UVMap", scale: float = 1.0) -> bpy.types.Object:
    layer = obj.data.uv_layers.new(name=name)
    layer.data.foreach_set("uv", scale * np.array([0, 0, 1, 0, 1, 1, 0, 1], dtype=np.float32))
    return obj


def _picture(size: int = 8, colorspace: str = "Non-Color") -> tuple[bpy.types.Image, np.ndarray]:
    image = bpy.data.images.new("Picture", size, size)
    image.colorspace_settings.name = colorspace
    pixels = np.ones((size, size, 4), dtype=np.float32)
    pixels[..., :3] = np.random.default_rng(1).integers(0, 240, (size, size, 3)) / 255
    image.pixels.foreach_set(pixels.ravel())
    return image, pixels


def _samples(images: SurfaceImages, triangle: int, count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Return values (n, 7) looked up in a triangle of the images, and the weights (n, 2) of its corners."""
    weights = np.random.default_rng(2).dirichlet((1, 1, 1), count)[:, 1:]
    return images.at(np.full(count, triangle), weights), weights


def _look_up(images: SurfaceImages, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return texels (n, 7) of all triangles at their own sample points, and these points in the world."""
    height, width = images.values.shape[:2]
    values, points = [], []
    for triangle in np.flatnonzero(images.textured):
        first, second, third = images.image_uv[triangle] * (width, height) - 0.5
        leg = round(np.abs(second - first).max()) + 1
        i, j = np.meshgrid(np.arange(leg), np.arange(leg))
        i, j = i[i + j < leg], j[i + j < leg]
        along, across = np.sign(second - first), np.sign(third - first)
        places = np.rint(first + i[:, None] * along + j[:, None] * across).astype(int)
        values.append(images.values[places[:, 1], places[:, 0]])
        weights = np.stack([i + 1 / 3, j + 1 / 3], axis=1) / leg
        corner = scene.triangles[triangle]
        points.append(corner[0] + weights @ (corner[1:] - corner[0]))
    return np.concatenate(values), np.concatenate(points)


@pytest.mark.parametrize("colorspace", ["Non-Color", "sRGB"])
def test_an_image_texture_gives_its_own_texels(colorspace: str) -> None:
    from radiosity_addon.blender.datablocks.image_values import linear_from_srgb

    image, pixels = _picture(8, colorspace)
    material, node = diffuse_of("ShaderNodeTexImage")
    node.image, node.interpolation = image, "Closest"
    _square_uvs(add_mesh("Quad", material=material))
    scene = _scene()
    values, points = _look_up(scene.images, scene)
    assert len(values) > 10_000
    place = np.floor((points[:, :2] + 1) / 2 * 8).astype(int)
    expected = pixels[place[:, 1], place[:, 0], :3]
    if colorspace == "sRGB":
        expected = linear_from_srgb(expected)
    np.testing.assert_allclose(values[:, :3], expected, atol=2e-6)
    assert (values[:, 3:6] == 0).all()
    assert (values[:, 6] == 1).all()
    # Each of its texels counts with a 64th of the area.
    mean = scene.reflectance.mean(axis=0)
    exact = (linear_from_srgb(pixels) if colorspace == "sRGB" else pixels)[..., :3].mean(axis=(0, 1))
    np.testing.assert_allclose(mean, exact, rtol=5e-3)


def test_uv_maps_are_taken_by_name_and_the_rendered_one_by_default() -> None:
    image, pixels = _picture()
    material, node = diffuse_of("ShaderNodeTexImage")
    node.image, node.interpolation = image, "Closest"
    named, other = diffuse_of("ShaderNodeTexImage")
    other.image, other.interpolation = image, "Closest"
    uv_map = named.node_tree.nodes.new("ShaderNodeUVMap")
    uv_map.uv_map = "Second"
    mapping = add_node(named.node_tree, "ShaderNodeMapping", Location=(0.25, 0.5, 0.0))
    named.node_tree.links.new(uv_map.outputs["UV"], mapping.inputs["Vector"])
    named.node_tree.links.new(mapping.outputs["Vector"], other.inputs["Vector"])
    for z, one in enumerate((material, named)):
        obj = add_mesh(f"Quad {z}", material=one, location=(0, 0, z))
        _square_uvs(obj, "First", 3.0)
        _square_uvs(obj, "Second", 2.0)
        obj.data.uv_layers["First" if one is named else "Second"].active_render = True
    scene = _scene()
    values, points = _look_up(scene.images, scene)
    shift = np.where(points[:, 2:] > 0.5, (0.25, 0.5), (0.0, 0.0))
    place = np.floor((points[:, :2] + 1 + shift) * 8).astype(int) % 8
    np.testing.assert_allclose(values[:, :3], pixels[place[:, 1], place[:, 0], :3], atol=2e-6)


@pytest.mark.parametrize("node", ["ShaderNodeVertexColor", "ShaderNodeAttribute"])
@pytest.mark.parametrize(("domain", "kind"), [("CORNER", "FLOAT_COLOR"), ("POINT", "BYTE_COLOR")])
def test_vertex_colors(node: str, domain: str, kind: str) -> None:
    material, source = diffuse_of(node)
    if node == "ShaderNodeVertexColor":
        source.layer_name = "Paint"
    else:
        source.attribute_name = "Paint"
    obj = add_mesh("Quad", material=material)
    obj.data.attributes.new("Other", kind, domain)
    paint = obj.data.attributes.new("Paint", kind, domain)
    colors = np.random.default_rng(3).uniform(0.1, 0.8, (4, 4)).astype(np.float32)
    paint.data.foreach_set("color", colors.ravel())
    stored = np.empty(16, dtype=np.float32)
    paint.data.foreach_get("color", stored)
    colors = stored.reshape(4, 4)[:, :3]
    scene = _scene()
    values, points = _look_up(scene.images, scene)
    corner = scene.triangles.reshape(-1, 3)
    place = np.array([np.abs(np.array(v.co) - corner).sum(axis=1).argmin() for v in obj.data.vertices])
    assert len(set(place)) == 4
    matrix = np.column_stack([corner, np.ones(len(corner))])
    vertex = np.array(
        [np.abs(np.array([v.co for v in obj.data.vertices]) - c).sum(axis=1).argmin() for c in corner]
    )
    for triangle in range(len(scene)):
        own = slice(3 * triangle, 3 * triangle + 3)
        weights = np.linalg.lstsq(
            matrix[own].T, np.column_stack([points, np.ones(len(points))]).T, rcond=None
        )[0].T
        half = len(points) // 2
        part = slice(0, half) if triangle == 0 else slice(half, None)
        np.testing.assert_allclose(values[part, :3], (weights @ colors[vertex[own]])[part], atol=1e-4)


_PROCEDURAL = {
    "noise": ("ShaderNodeTexNoise", "Color", None),
    "noise of its object": ("ShaderNodeTexNoise", "Color", ("ShaderNodeTexCoord", "Object")),
    "noise in the world": ("ShaderNodeTexNoise", "Color", ("ShaderNodeNewGeometry", "Position")),
    "checker": ("ShaderNodeTexChecker", "Color", None),
    "bricks": ("ShaderNodeTexBrick", "Color", ("ShaderNodeTexCoord", "Object")),
    "waves": ("ShaderNodeTexWave", "Color", ("ShaderNodeTexCoord", "UV")),
    "voronoi": ("ShaderNodeTexVoronoi", "Color", None),
    "magic": ("ShaderNodeTexMagic", "Color", ("ShaderNodeTexCoord", "Normal")),
    "its place": ("ShaderNodeObjectInfo", "Location", None),
    "its color": ("ShaderNodeObjectInfo", "Color", None),
    "its number": ("ShaderNodeObjectInfo", "Random", None),
    "its normal": ("ShaderNodeNewGeometry", "Normal", None),
}


@pytest.mark.parametrize("kind", _PROCEDURAL)
def test_procedural_nodes_as_cycles_bakes_them_on_the_object_itself(kind: str) -> None:
    texture, output, coordinates = _PROCEDURAL[kind]
    material = shader_material("M", "ShaderNodeEmission")
    tree = material.node_tree
    node = tree.nodes.new(texture)
    if coordinates is not None:
        source = tree.nodes.new(coordinates[0])
        tree.links.new(source.outputs[coordinates[1]], node.inputs["Vector"])
    if "Scale" in node.inputs:
        node.inputs["Scale"].default_value = 0.4 if kind == "bricks" else 1.3
    feed(material, node.outputs[output])
    # A name beyond ASCII: its bytes count into its number.
    obj = add_mesh("Höcker", CUBE, CUBE_FACES, material=material, location=(0.4, 0.2, 0.3))
    obj.rotation_euler, obj.scale, obj.color = (0.3, 0.4, 0.5), (1, -2, 0.5), (0.3, 0.5, 0.7, 1)
    for vertex in obj.data.vertices:
        vertex.co.x = max(vertex.co.x * 1.5, -1.0)
    layer = obj.data.uv_layers.new(name="Layout")
    # Every face a sixth of the width: one row of squares.
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * 0.9 + 0.05
    uv = np.concatenate([(corners + np.array((face, 0))) / (6, 1) for face in range(6)]).astype(np.float32)
    layer.data.foreach_set("uv", uv.ravel())
    if kind == "its normal":
        obj.data.shade_smooth()
    expected = _bake_itself(obj, 384, 64)
    exported = export_scene(bpy.context, BakeSettings(resolution=128)).bake_scene
    at_loops = uv[exported.objects[0].loops]
    images = exported.scene.images
    for triangle in range(len(images)):
        values, weights = _samples(images, triangle, 400)
        place = at_loops[triangle, 0] + weights @ (at_loops[triangle, 1:] - at_loops[triangle, 0])
        column, row = (place * (384, 64)).astype(int).T
        theirs = np.maximum(expected[row, column], 0.0) * math.pi
        # The same function, read half a texel apart at most; where it jumps, that differs.
        off = np.abs(values[:, 3:6] - theirs).max(axis=1)
        assert np.median(off) < 0.03 * max(theirs.max(), 0.1)
        assert (off > 0.2 * max(theirs.max(), 0.1)).mean() < 0.12


def _bake_itself(obj: bpy.types.Object, width: int, height: int) -> np.ndarray:
    """Return (height, width, 3) what Cycles bakes of an object's emission."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples = "CPU", 1
    image = bpy.data.images.new("Itself", width, height, float_buffer=True, is_data=True)
    nodes = obj.data.materials[0].node_tree.nodes
    target = nodes.new("ShaderNodeTexImage")
    target.image = image
    nodes.active = target
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    assert bpy.ops.object.bake(type="EMIT", margin=2) == {"FINISHED"}
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    nodes.remove(target)
    return pixels.reshape(height, width, 4)[..., :3]


def test_instances_have_their_own_numbers() -> None:
    material, _ = diffuse_of("ShaderNodeObjectInfo", "Random")
    collection = bpy.data.collections.new("Many")
    add_mesh("Quad", material=material, collection=collection)
    for number in range(3):
        add_instance(collection, f"Instance {number}", location=(0, 0, number))
    assert len(np.unique(_scene().reflectance[:, 0].round(6))) == 3


def test_hundreds_of_objects_take_one_bake(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    bake = surface_bake.bake_emission
    monkeypatch.setattr(surface_bake, "bake_emission", lambda: calls.append(1) or bake())
    for kind in ("ShaderNodeTexNoise", "ShaderNodeTexChecker", "ShaderNodeTexVoronoi"):
        material, _ = diffuse_of(kind)
        for number in range(100):
            add_mesh(f"{kind} {number}", material=material, location=(3 * number, 0, 0))
    images = _images()
    assert len(calls) == 1
    assert images.textured.sum() == 600
    assert images.values.size < 1.3 * 7 * 256**2


def test_constant_materials_are_not_evaluated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surface_bake, "bake_emission", lambda: pytest.fail("nothing varies"))
    add_cube(material=shader_material("M", "ShaderNodeBsdfPrincipled", Base_Color=RED))
    assert _scene().images is None
    add_mesh("Pane", material=cut_out())
    scene = _scene()
    assert scene.images.textured.sum() == 2
    np.testing.assert_allclose(scene.opacity, np.where(scene.images.textured, 0.3, 1.0), rtol=1e-6)


def test_opacity_of_an_image_s_alpha() -> None:
    image, pixels = _picture()
    pixels[..., 3] = np.random.default_rng(4).integers(0, 2, (8, 8))
    image.alpha_mode = "CHANNEL_PACKED"
    image.pixels.foreach_set(pixels.ravel())
    material = shader_material("Leaf", "ShaderNodeBsdfPrincipled", Specular_IOR_Level=0.0, Base_Color=RED)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = image, "Closest"
    feed(material, node.outputs["Alpha"], "Alpha")
    _square_uvs(add_mesh("Leaf", material=material))
    scene = _scene()
    values, points = _look_up(scene.images, scene)
    place = np.floor((points[:, :2] + 1) / 2 * 8).astype(int)
    alpha = pixels[place[:, 1], place[:, 0], 3]
    np.testing.assert_array_equal(values[:, 6], alpha)
    np.testing.assert_allclose(values[:, :3], alpha[:, None] * RED[:3], atol=1e-6)


def test_a_shadow_ray_switch_lets_light_pass_and_reflects_all_the_same() -> None:
    material = shader_material("Pane", "ShaderNodeMixShader")
    tree = material.node_tree
    mix = next(node for node in tree.nodes if node.type == "MIX_SHADER")
    tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs["Is Shadow Ray"], mix.inputs[0])
    tree.links.new(add_node(tree, "ShaderNodeEmission", Color=BLUE).outputs[0], mix.inputs[1])
    tree.links.new(
        add_node(tree, "ShaderNodeBsdfTransparent", Color=(0.75,) * 3 + (1,)).outputs[0], mix.inputs[2]
    )
    add_mesh("Pane", material=material)
    scene = _scene()
    np.testing.assert_allclose(scene.opacity, 0.25, atol=1e-6)
    np.testing.assert_allclose(scene.emission, np.tile(np.array(BLUE[:3]) * math.pi, (2, 1)), rtol=1e-5)


def test_the_file_is_the_same_afterwards() -> None:
    build_zoo(bpy.context)
    for number, make in enumerate(ZOO.values()):
        material = make()
        make_all_vary(material.node_tree)
        add_mesh(f"Evaluated {number}", material=material, location=(0, 0, 5 + number))
    before = tidy_dump()
    assert _scene().images is not None
    assert differences_since(before, tidy_dump()) == []


def test_what_only_the_camera_sees_is_left_out_where_colors_vary() -> None:
    material, mix = diffuse_of("ShaderNodeMixRGB", Color1=RED)
    tree = material.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs["Color"], mix.inputs["Color2"])
    add_mesh("Quad", material=material)
    values, _ = _samples(_images(), 0)
    np.testing.assert_allclose(values[:, :3], np.tile(RED[:3], (len(values), 1)), atol=1e-5)


@pytest.mark.parametrize("of", ["scene", "view layer"])
def test_attributes_of_the_view_layer(of: str) -> None:
    owner = bpy.context.scene if of == "scene" else bpy.context.view_layer
    owner["gray"], owner["note"] = 0.25, "not a number"
    material, node = diffuse_of("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = "VIEW_LAYER", "gray"
    add_mesh("Quad", material=material)
    values, _ = _samples(_images(), 0)
    np.testing.assert_allclose(values[:, :3], 0.25, atol=1e-5)
