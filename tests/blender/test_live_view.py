"""What the viewports show while a bake solves; the drawing itself needs a window (tests/app)."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise, product
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from radiosity_addon.bake.result.pictures import Picture
from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.jobs import live_view
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.blender.jobs.live_picture import corner_arrays, display_colors, seen_triangles
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options.bake_settings import BakeSettings

pytestmark = pytest.mark.usefixtures("registered")

QUICK = BakeSettings(resolution=32, quality="sketch", method="shooting", elements=60, max_iterations=5)


def pictures(in_background: bool = False) -> list[Picture]:
    job = run_bake(bpy.context, QUICK, None, in_background=in_background)
    return [status.picture for status in job if isinstance(status.picture, Picture)]


def seen_names() -> set[str]:
    """The objects of which anything is seen; every object is seen wholly or not at all."""
    export = export_scene(bpy.context, QUICK)
    seen = seen_triangles(bpy.context, export)
    for item in export.bake_scene.objects:
        assert seen[item.rows].all() or not seen[item.rows].any()
    return {item.name for item in export.bake_scene.objects if seen[item.rows].any()}


def test_a_white_surface_that_gets_pi_watts_shows_white() -> None:
    """B = π W/m² is a radiance of 1, which view transforms without soft highlights show white."""
    radiosity = np.pi * np.array([[0.0, 0.18, 1.0], [0.5, 0.0031308, 7.0]])
    expected = [[0.0, 0.46135613, 1.0], [0.73535698, 0.04044994, 1.0]]  # IEC 61966-2-1
    np.testing.assert_allclose(display_colors(radiosity, 1.0, 1.0), expected, atol=1e-6)
    np.testing.assert_array_equal(
        display_colors(radiosity, 4.0, 1.0), display_colors(4.0 * radiosity, 1.0, 1.0)
    )


def test_soft_highlights_reach_white_only_at_the_white_point() -> None:
    radiance = np.linspace(0.0, 16.0, 200)
    colors = display_colors(np.pi * np.repeat(radiance[:, None], 3, axis=1), 1.0, 16.0)[:, 0]
    assert (np.diff(colors) > 0).all()
    assert colors[0] == 0.0
    assert colors[-1] == pytest.approx(1.0, abs=1e-6)
    # Shadows keep their brightness: the compression is L − L² to first order.
    assert display_colors(np.full((1, 3), np.pi * 1e-3), 1.0, 16.0)[0, 0] == pytest.approx(12.92e-3, rel=2e-3)


@pytest.mark.parametrize("kind", ["SOLID", "MATERIAL", "RENDERED"])
def test_a_viewport_that_any_light_of_the_scene_lights_shows_its_exposure(kind: str) -> None:
    """A render has switches of its own; a solid viewport is taken for the material preview."""
    names = ("use_scene_lights", "use_scene_world", "use_scene_lights_render", "use_scene_world_render")
    for values in product((False, True), repeat=4):
        shading = SimpleNamespace(type=kind, **dict(zip(names, values, strict=True)))
        in_use = values[2:] if kind == "RENDERED" else values[:2]
        assert live_view.uses_exposure(shading) == any(in_use)


def test_corners_of_an_element_share_its_color() -> None:
    corners = np.arange(18, dtype=np.float32).reshape(2, 3, 3)
    radiosity = np.array([[1.0, 2.0, 3.0], [0.1, 0.0, 0.2]], dtype=np.float32)
    picture = Picture(corners, radiosity, np.arange(2, dtype=np.int32), np.ones(2, dtype=bool))
    positions, colors = corner_arrays(picture, 1.0, 16.0)
    np.testing.assert_array_equal(positions.reshape(2, 3, 3), corners)
    for corner in range(3):
        np.testing.assert_array_equal(colors[corner::3, :3], display_colors(radiosity, 1.0, 16.0))
    assert (colors[:, 3] == 1.0).all()
    assert (positions.dtype, colors.dtype) == (np.float32, np.float32)


@pytest.mark.parametrize(
    "hide",
    [
        lambda obj: obj.hide_set(True),
        lambda obj: setattr(obj, "hide_viewport", True),
        lambda obj: setattr(obj, "display_type", "WIRE"),
        lambda obj: setattr(obj.users_collection[0], "hide_viewport", True),
    ],
    ids=["hidden", "disabled", "wire", "collection"],
)
def test_what_the_viewport_hides_stays_hidden(hide: Callable[[bpy.types.Object], None]) -> None:
    scene = build_cornell_box()
    everything = {obj.name for obj in scene.objects if obj.type == "MESH"}
    assert seen_names() == everything
    wall = bpy.data.objects["Right Wall"]
    apart = bpy.data.collections.new("Apart")
    scene.collection.children.link(apart)
    for collection in wall.users_collection:
        collection.objects.unlink(wall)
    apart.objects.link(wall)
    hide(wall)
    assert seen_names() == everything - {"Right Wall"}


def test_instances_are_seen_where_their_instancer_is() -> None:
    scene = build_cornell_box()
    block = bpy.data.objects["Short Block"]
    source = bpy.data.collections.new("Source")
    for collection in block.users_collection:
        collection.objects.unlink(block)
    source.objects.link(block)
    shown, hidden = (bpy.data.objects.new(name, None) for name in ("Shown", "Hidden"))
    for empty in (shown, hidden):
        empty.instance_type, empty.instance_collection = "COLLECTION", source
        scene.collection.objects.link(empty)
    hidden.hide_set(True)
    names = seen_names()
    assert "Shown/Short Block" in names
    assert "Hidden/Short Block" not in names


@pytest.mark.parametrize("in_background", [False, True])
def test_a_bake_comes_with_pictures_that_brighten(
    in_background: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("radiosity_addon.bake.pipeline.PICTURE_SECONDS", 0.0)
    build_cornell_box()
    came = pictures(in_background)
    # Before it begins, direct light, after each of the shots, at the end.
    assert len(came) >= QUICK.max_iterations + 3
    # The walls emit nothing; afterwards no element ever gets darker, and most inside brighten.
    assert not came[0].radiosity.any()
    lit = came[1:]
    for before, after in pairwise(lit):
        np.testing.assert_array_equal(before.corners, after.corners)
        assert (after.radiosity >= before.radiosity).all()
    brightened = (lit[-1].radiosity > lit[0].radiosity).any(axis=1)
    assert brightened[lit[-1].front].mean() > 0.8


def test_pictures_hold_only_what_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("radiosity_addon.bake.pipeline.PICTURE_SECONDS", 0.0)
    build_cornell_box()
    whole = pictures()[-1]
    bpy.data.objects["Right Wall"].hide_set(True)
    rest = pictures()[-1]
    objects = export_scene(bpy.context, QUICK).bake_scene.objects
    wall = next(item.rows for item in objects if item.name == "Right Wall")
    on_wall = (whole.triangle >= wall.start) & (whole.triangle < wall.stop)
    assert {bool(front) for front in whole.front[on_wall]} == {True, False}
    for name in ("corners", "radiosity", "triangle", "front"):
        np.testing.assert_array_equal(getattr(rest, name), getattr(whole.only(~on_wall), name))


def test_without_a_window_nothing_is_begun() -> None:
    live_view.begin(build_cornell_box())
    assert not live_view.is_active()
    assert not [handler for handler in bpy.app.handlers.load_pre if handler.__module__ == live_view.__name__]
    live_view.end()
