"""The first picture of viewer.html is the render: exposure, view transform, and what is behind objects."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Vector

import radiosity_addon
from radiosity_addon.blender.command_line.main import main
from radiosity_addon.blender.material_copies.lightmap_materials import show_lightmaps
from tests.blender.scenes import add_mesh, shader_material
from tests.browser.browser import chromium, viewer

pytestmark = pytest.mark.one_blender

SIZE = (300, 200)
BAKE = ("--resolution", "64", "--quality", "draft", "--no-preview", "--quiet", "--export", "web")


def build(path: Path, transform: str, exposure: float) -> None:
    """Save a floor under a sky that has another color in each direction."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    add_mesh(
        "Floor", ((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)), ((0, 1, 2, 3),)
    ).data.materials.append(shader_material("Paint", "ShaderNodeBsdfDiffuse", Color=(0.6, 0.4, 0.2, 1.0)))
    world = scene.world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    place, scaled = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeVectorMath")
    scaled.operation = "MULTIPLY_ADD"
    scaled.inputs[1].default_value = scaled.inputs[2].default_value = (0.5, 0.5, 0.5)
    links.new(place.outputs["Generated"], scaled.inputs[0])
    links.new(scaled.outputs[0], next(n for n in nodes if n.type == "BACKGROUND").inputs["Color"])
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (2.5, -5.0, 2.0), (1.3, 0.0, 0.5)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.view_settings.view_transform, scene.view_settings.exposure = transform, exposure
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def pixels_of(path: Path) -> np.ndarray:
    """A picture (height, width, 3) in [0, 1], row 0 at the bottom."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    found = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(found)
    width, height = image.size
    bpy.data.images.remove(image)
    return found.reshape(height, width, -1)[..., :3]


def bake_and_render(folder: Path, samples: int, matte: bool = False) -> None:
    """Bake and export `open.blend` into `out`, and render what was baked into `render.png`."""
    radiosity_addon.register()
    assert main(["bake", str(folder / "open.blend"), "--output", str(folder / "out"), *BAKE]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(folder / "out" / "baked.blend"))
    if matte:
        show_lightmaps("matte")
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", samples
    scene.render.filepath = str(folder / "render.png")
    bpy.ops.render.render(write_still=True)
    radiosity_addon.unregister()


@pytest.mark.parametrize(
    ("transform", "exposure", "largest"),
    [("Standard", -0.7, 0.02), ("AgX", 0.5, 0.05), pytest.param("Filmic", 0.0, 0.15, marks=pytest.mark.full)],
)
def test_the_first_picture_is_the_render(
    tmp_path: Path, transform: str, exposure: float, largest: float
) -> None:
    """Filmic, which three.js does not have, is only about as bright."""
    chromium()
    build(tmp_path / "open.blend", transform, exposure)
    bake_and_render(tmp_path, samples=4, matte=True)
    with viewer(tmp_path / "out" / "export" / "viewer.html", *SIZE) as shown:
        shown.evaluated("document.getElementById('panel').hidden = true")
        (tmp_path / "viewer.png").write_bytes(shown.picture())
        shown.evaluated("document.getElementById('auto').click()")
        automatic = shown.evaluated("viewer.renderer.toneMappingExposure")
    error = np.abs(pixels_of(tmp_path / "viewer.png") - pixels_of(tmp_path / "render.png")).max(axis=2)
    assert np.quantile(error, 0.95) < largest  # without edges
    assert automatic not in (1.0, 2.0**exposure)


def test_a_transparent_film_leaves_the_background_to_the_page(tmp_path: Path) -> None:
    build(tmp_path / "open.blend", "Standard", 0.0)
    bpy.context.scene.render.film_transparent = True
    bpy.ops.wm.save_mainfile()
    radiosity_addon.register()
    assert main(["bake", str(tmp_path / "open.blend"), "--output", str(tmp_path / "out"), *BAKE]) == 0
    radiosity_addon.unregister()
    page = (tmp_path / "out" / "export" / "viewer.html").read_text(encoding="utf-8")
    assert 'data-file="background.ktx2"' not in page
    assert 'data-file="scene.glb"' in page


def test_metal_mirrors_what_is_around(tmp_path: Path) -> None:
    """A ball of metal shows the sky on all sides; of a lightmap alone it would be black."""
    chromium()
    build(tmp_path / "open.blend", "Standard", 0.0)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.6, location=(0, 0, 0.8), segments=64, ring_count=32)
    metal = shader_material(
        "Metal",
        "ShaderNodeBsdfPrincipled",
        Metallic=1.0,
        Roughness=0.1,
        **{"Base Color": (0.9, 0.9, 0.9, 1.0)},
    )
    ball = bpy.context.object
    ball.data.materials.append(metal)
    ball.data.shade_smooth()
    direction = Vector((0, 0, 0.8)) - bpy.context.scene.camera.location
    bpy.context.scene.camera.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()
    bpy.ops.wm.save_mainfile()
    bake_and_render(tmp_path, samples=64)
    with viewer(tmp_path / "out" / "export" / "viewer.html", *SIZE) as shown:
        shown.evaluated("document.getElementById('panel').hidden = true")
        (tmp_path / "viewer.png").write_bytes(shown.picture())
        metals = "[...viewer.shiny.materials.values()].filter(m => m.envMap).map(m => m.name)"
        assert shown.evaluated(metals) == ["Metal"]
        shown.evaluated("document.getElementById('only').click()")
        assert shown.evaluated(metals) == []
        shown.evaluated("document.getElementById('only').click()")
        assert shown.evaluated(metals) == ["Metal"]
    middle = (slice(70, 130), slice(120, 180))
    drawn, rendered = (pixels_of(tmp_path / name)[middle] for name in ("viewer.png", "render.png"))
    assert rendered.max() > 0.4
    assert np.quantile(np.abs(drawn - rendered).max(axis=2), 0.8) < 0.1


def test_textures_seen_at_a_slant_are_sharp(tmp_path: Path) -> None:
    """Stripes along the view, on a floor that is shrunk little across them and tenfold along them."""
    chromium()
    build(tmp_path / "open.blend", "Standard", 0.0)
    floor = bpy.data.objects["Floor"]
    floor.data.uv_layers.new(name="UVMap").data.foreach_set("uv", (0, 0, 1, 0, 1, 1, 0, 1))
    stripes = bpy.data.images.new("Stripes", 256, 256)
    columns = np.where(np.arange(256) // 4 % 2, 0.9, 0.1)
    stripes.pixels.foreach_set(np.repeat(np.tile(columns, 256), 4).astype(np.float32))
    stripes.pack()
    tree = floor.data.materials[0].node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    image.image = stripes
    diffuse = next(node for node in tree.nodes if node.type == "BSDF_DIFFUSE")
    tree.links.new(image.outputs["Color"], diffuse.inputs["Color"])
    camera = bpy.context.scene.camera
    camera.location = (0.0, -4.0, 0.25)
    camera.rotation_euler = (Vector((0, 0, 0)) - camera.location).to_track_quat("-Z", "Y").to_euler()
    bpy.ops.wm.save_mainfile()
    radiosity_addon.register()
    assert main(["bake", str(tmp_path / "open.blend"), "--output", str(tmp_path / "out"), *BAKE]) == 0
    radiosity_addon.unregister()
    with viewer(tmp_path / "out" / "export" / "viewer.html", *SIZE) as shown:
        shown.evaluated("document.getElementById('panel').hidden = true")
        (tmp_path / "viewer.png").write_bytes(shown.picture())
    row = pixels_of(tmp_path / "viewer.png")[100, 110:190].mean(axis=1)  # the middle of the floor
    assert row.max() - row.min() > 0.4 * row.max(), (row.min(), row.max())
