"""What overlays show, as arrays; that it gets to the screen needs a window (tests/app)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.blender.overlays import overlay_properties as kinds
from radiosity_addon.blender.overlays import overlay_view
from radiosity_addon.blender.overlays.color_scale import ColorScale, automatic_scale
from radiosity_addon.blender.overlays.lightmap_values import lightmap_of, object_statistics, page_values
from radiosity_addon.blender.overlays.overlay_pictures import (
    CHECKERS,
    MAX_PICTURE_WIDTH,
    STATE_COLORS,
    OverlayPicture,
    chosen_elements,
    coarse_page,
    missing,
    overlay_picture,
)
from radiosity_addon.blender.session.kept_details import details_of
from radiosity_addon.blender.session.state import session
from radiosity_addon.numerics.radiometry import luminous
from radiosity_addon.options.bake_settings import BakeSettings

EVERY = (
    *(kinds.FALSE_COLOR, kinds.DENSITY, kinds.CHECKER, kinds.TEXELS),
    *(kinds.ELEMENTS, kinds.LINKS, kinds.ERROR),
)


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Any]]:
    """The Cornell box, baked once, as a file and as what was kept in memory."""
    radiosity_addon.register()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = build_cornell_box()
    settings = BakeSettings(resolution=64, quality="draft", quantity="irradiance", threads=1)
    job = run_bake(bpy.context, settings, None)
    while True:
        try:
            next(job)
        except StopIteration as done:
            report = done.value.as_dict()
            break
    path = tmp_path_factory.mktemp("baked") / "baked.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    yield {"path": path, "report": report, "kept": dict(session.kept_details), "scene": scene.name}
    radiosity_addon.unregister()


@pytest.fixture
def opened(baked: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The baked file, open, with what the bake kept."""
    radiosity_addon.register()
    bpy.ops.wm.open_mainfile(filepath=str(baked["path"]))
    session.kept_details.update(baked["kept"])
    yield baked
    settings = bpy.context.window_manager.radiosity_overlay
    for prop in settings.bl_rna.properties:
        settings.property_unset(prop.identifier)


def settings() -> Any:
    return bpy.context.window_manager.radiosity_overlay


def shown(kind: str) -> OverlayPicture:
    settings().show = kind
    assert missing(bpy.context) == ""
    picture = overlay_picture(bpy.context)
    assert picture is not None
    return picture


def seen_colors(picture: OverlayPicture) -> np.ndarray:
    """(t, 4) what is painted on the middle of every triangle."""
    surfaces = picture.surfaces
    assert surfaces is not None
    found = []
    for page, uv in zip(surfaces.page, surfaces.uv.mean(axis=1), strict=True):
        colors = surfaces.pages[page]
        column, row = (uv * [colors.shape[1], colors.shape[0]]).astype(int)
        found.append(colors[row, column])
    return np.array(found)


def test_false_colors_are_those_of_the_light_in_lux(opened: dict[str, Any]) -> None:
    picture = shown(kinds.FALSE_COLOR)
    assert picture.legend is not None
    assert (picture.legend.title, picture.legend.unit) == ("Illuminance", "lx")
    image = lightmap_of(bpy.data.objects["Floor"])
    page = page_values(image)
    assert page is not None
    expected = picture.legend.scale(luminous(page.values, 683.0))  # type: ignore[misc]
    np.testing.assert_array_equal(picture.surfaces.pages[0][..., :3], expected)  # type: ignore[union-attr]
    settings().efficacy = 68.3
    lower = shown(kinds.FALSE_COLOR)
    assert lower.legend.scale.high == pytest.approx(0.1 * picture.legend.scale.high)  # type: ignore[union-attr]
    settings().unit = "WATT"
    assert shown(kinds.FALSE_COLOR).legend.unit == "W/m²"  # type: ignore[union-attr]


def test_a_range_by_hand_is_kept(opened: dict[str, Any]) -> None:
    settings().automatic, settings().low, settings().high = False, 100.0, 300.0
    for kind in (kinds.FALSE_COLOR, kinds.DENSITY, kinds.LINKS, kinds.ERROR):
        scale = shown(kind).legend.scale  # type: ignore[union-attr]
        assert (scale.low, scale.high) == (100.0, 300.0)  # type: ignore[union-attr]
        assert scale.ticks()[0] == (100.0, "100")  # type: ignore[union-attr]


@pytest.mark.parametrize("kept", [True, False], ids=["kept", "reloaded"])
def test_numbers_of_an_object_are_the_reports(opened: dict[str, Any], kept: bool) -> None:
    if not kept:
        session.kept_details.clear()
    session.drawn.forget()
    for entry in opened["report"]["objects"]:
        obj = bpy.data.objects[entry["object"]]
        found = object_statistics(obj, bpy.context.scene, "WATT", 683.0)
        lux = object_statistics(obj, bpy.context.scene, "LUX", 683.0)
        assert found is not None
        assert lux is not None
        assert (found[1], lux[1]) == ("W/m²", "lx")
        # Without the texels' states those that geometry divides count as well.
        for of, name, told in ((found, "W/m²", "irradiance_W_m2"), (lux, "lx", "illuminance_lx")):
            assert of[0].mean == pytest.approx(entry[told]["mean"], rel=1e-4 if kept else 0.1), name
            assert of[0].minimum == pytest.approx(entry[told]["minimum"], rel=1e-3) or not kept
            assert of[0].maximum == pytest.approx(entry[told]["maximum"], rel=1e-3) or not kept


def test_density_follows_from_uvs_and_image_size(opened: dict[str, Any]) -> None:
    picture = shown(kinds.DENSITY)
    density = opened["report"]["pages"][0]["texels_per_metre"]
    assert picture.legend.scale.high == pytest.approx(2.0 * density, rel=0.02)  # type: ignore[union-attr]
    # Alike on all objects: the middle of the scale everywhere.
    np.testing.assert_allclose(
        seen_colors(picture)[:, :3], picture.legend.scale(np.full(34, density)), atol=0.05
    )  # type: ignore[union-attr,misc]
    floor = bpy.data.objects["Floor"]
    floor.scale *= 2.0
    bpy.context.view_layer.update()
    colors = seen_colors(shown(kinds.DENSITY))
    assert len(np.unique(colors.round(3), axis=0)) > 1


def test_the_checker_changes_from_texel_to_texel(opened: dict[str, Any]) -> None:
    page = shown(kinds.CHECKER).surfaces.pages[0]  # type: ignore[union-attr]
    assert page.shape == (64, 64, 4)
    np.testing.assert_allclose(page[0, :2, :3], CHECKERS)
    np.testing.assert_allclose(page[1, :2, :3], CHECKERS[::-1])
    settings().squares = 4
    page = shown(kinds.CHECKER).surfaces.pages[0]  # type: ignore[union-attr]
    assert (page[:4, :4] == page[0, 0]).all()
    assert (page[0, 4] != page[0, 0]).any()


def test_doubtful_texels_lie_below_the_blocks(opened: dict[str, Any]) -> None:
    picture = shown(kinds.TEXELS)
    page = picture.surfaces.pages[0]  # type: ignore[union-attr]
    kept = details_of(bpy.context.scene)
    assert kept is not None
    for state, (color, _) in STATE_COLORS.items():
        marked = kept.details.pages[0].state == state
        np.testing.assert_allclose(page[marked], np.broadcast_to((*color, 1.0), (marked.sum(), 4)))
    assert (kept.details.pages[0].state == 1).any()
    assert (page[kept.details.pages[0].state == 0] == 0.0).all()


def test_elements_are_outlined(opened: dict[str, Any]) -> None:
    (lines,) = shown(kinds.ELEMENTS).lines
    kept = details_of(bpy.context.scene)
    assert kept is not None
    record = kept.details.links
    assert len(lines.ends) == 3 * int((record.leaf & record.front).sum())
    length = np.linalg.norm(lines.ends[:, 0] - lines.ends[:, 1], axis=1)
    assert length.min() > 0
    bpy.data.objects["Floor"].hide_set(True)
    assert len(shown(kinds.ELEMENTS).lines[0].ends) < len(lines.ends)


def test_links_of_the_active_face_and_of_the_cursor(opened: dict[str, Any]) -> None:
    floor = bpy.data.objects["Floor"]
    bpy.context.view_layer.objects.active = floor
    settings().links_of = "FACE"
    edges, links = shown(kinds.LINKS).lines
    height = floor.matrix_world.translation.z + min(v.co.z for v in floor.data.vertices)
    np.testing.assert_allclose(edges.ends[..., 2], height, atol=1e-5)
    np.testing.assert_allclose(links.ends[:, 0, 2], height, atol=1e-5)
    assert links.ends[:, 1, 2].max() > height + 1.0
    settings().most_links = 7
    few = shown(kinds.LINKS)
    assert len(few.lines[1].ends) == 7

    settings().links_of = "CURSOR"
    kept = details_of(bpy.context.scene)
    assert kept is not None
    corners = kept.details.links.corners[-1]
    bpy.context.scene.cursor.location = corners.mean(axis=0).tolist()
    (chosen,) = chosen_elements(bpy.context, kept)
    np.testing.assert_allclose(
        kept.details.links.corners[chosen].mean(axis=0), corners.mean(axis=0), atol=1e-6
    )
    bpy.context.view_layer.objects.active = None
    settings().links_of = "FACE"
    assert overlay_picture(bpy.context) is None


@pytest.mark.parametrize("of", ["NOISE", "ELEMENTS"])
def test_errors_are_signed_where_they_can_be(opened: dict[str, Any], of: str) -> None:
    settings().error_of = of
    scale = shown(kinds.ERROR).legend.scale  # type: ignore[union-attr]
    assert scale.signed == (of == "ELEMENTS")  # type: ignore[union-attr]
    assert scale.low == (-scale.high if of == "ELEMENTS" else 0.0)  # type: ignore[union-attr]


def test_after_a_reload_only_data_of_the_file_is_left(opened: dict[str, Any]) -> None:
    session.kept_details.clear()
    for kind in EVERY:
        settings().show = kind
        if kind in kinds.OF_THE_BAKE:
            assert "memory" in missing(bpy.context)
            assert overlay_picture(bpy.context) is None
        else:
            shown(kind)


def test_opening_a_file_forgets_the_bake(opened: dict[str, Any]) -> None:
    assert details_of(bpy.context.scene) is not None
    bpy.ops.wm.open_mainfile(filepath=str(opened["path"]))
    assert details_of(bpy.context.scene) is None
    assert not session.kept_details


def test_another_bake_than_the_last_is_not_shown(opened: dict[str, Any]) -> None:
    scene = bpy.context.scene
    text = scene.radiosity.last_bake
    scene.radiosity.last_bake = text.replace("1", "2")
    assert details_of(scene) is None
    scene.radiosity.last_bake = text
    assert details_of(scene) is not None


def test_restore_forgets_it_and_says_so(opened: dict[str, Any]) -> None:
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert not session.kept_details
    for kind in EVERY:
        settings().show = kind
        assert "ake first" in missing(bpy.context)
        assert overlay_picture(bpy.context) is None


def test_before_a_bake_density_is_of_the_size_that_is_chosen() -> None:
    radiosity_addon.register()
    bpy.ops.mesh.primitive_plane_add(size=2.0)
    bpy.context.object.data.uv_layers[0].name = "Lightmap"
    bpy.context.scene.radiosity.resolution = 256
    picture = shown(kinds.DENSITY)
    assert picture.legend.scale.high == pytest.approx(256.0)  # type: ignore[union-attr]
    settings().show = kinds.NONE
    assert overlay_picture(bpy.context) is None


def test_an_unregistered_overlay_leaves_nothing() -> None:
    radiosity_addon.register()
    radiosity_addon.unregister()
    handlers = bpy.app.handlers
    for listed in (handlers.load_pre, handlers.undo_post, handlers.redo_post, handlers.depsgraph_update_post):
        assert not [handler for handler in listed if handler.__module__ == overlay_view.__name__]
    assert not hasattr(bpy.types.WindowManager, "radiosity_overlay")


def test_large_pages_are_drawn_coarser() -> None:
    page = np.arange(2 * MAX_PICTURE_WIDTH)[:, None] + np.zeros(2 * MAX_PICTURE_WIDTH)
    thin = coarse_page(page)
    assert thin.shape == (MAX_PICTURE_WIDTH, MAX_PICTURE_WIDTH)
    assert np.abs(thin[:, 0] / 2 - np.arange(MAX_PICTURE_WIDTH)).max() <= 1.0
    assert coarse_page(thin) is thin


def test_scales_end_at_round_numbers_and_clip() -> None:
    values = np.concatenate([np.linspace(0.0, 930.0, 1000), [1e6]])
    scale = automatic_scale(values)
    assert (scale.low, scale.high) == (0.0, 1000.0)
    np.testing.assert_array_equal(scale(np.array([-5.0, 1e9])), scale(np.array([0.0, 1000.0])))
    assert automatic_scale(np.zeros(0)).high == 1.0
    middle = ColorScale(-2.0, 2.0, signed=True)(np.array(0.0))
    assert np.ptp(middle) < 1e-6
