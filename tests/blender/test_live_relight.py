"""Live: lightmaps follow sliders, exact once these rest; anything else switches it off with a reason."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.blender.datablocks.image_marks import VERSION
from radiosity_addon.blender.images.node_group import EMISSION
from radiosity_addon.blender.relight.live_scene import LiveScene
from radiosity_addon.blender.relight.relight_scene import kept_bakes, lightmap_versions
from radiosity_addon.blender.session.state import session
from radiosity_addon.files.baked_files import digest_of_file
from tests.blender.edited_copies import lightmap_node
from tests.blender.scenes import shader_material
from tests.blender.test_relight_scene import change_lights, glowing, lightmap, relative, relight, room
from tests.wording import says


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The room, baked with a sidecar and saved."""
    path = tmp_path_factory.mktemp("live")
    radiosity_addon.register()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    room()
    bpy.ops.wm.save_as_mainfile(filepath=str(path / "room.blend"))
    bpy.context.scene.radiosity_relight.sidecar = True
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT") == {"FINISHED"}
    bpy.ops.wm.save_mainfile()
    yield path / "room.blend"
    radiosity_addon.unregister()


@pytest.fixture
def live(saved: Path) -> Iterator[bpy.types.WindowManager]:
    """The session, Live switched on and at rest. No timer fires in the module: `settle` stands for it."""
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    manager = bpy.context.window_manager
    manager.radiosity_live = True
    settle()
    assert manager.radiosity_live, session.live_message
    yield manager
    session.stop_live()


def settle() -> None:
    """Let the handler see what has changed, and do what the timer would."""
    bpy.context.view_layer.update()
    if session.live is not None:
        session.live.settle()


def follow() -> None:
    """As `settle`, but stop where sums of responses are shown."""
    bpy.context.view_layer.update()
    session.live.read()


def test_the_lightmap_follows_and_becomes_exact_at_rest(live: bpy.types.WindowManager) -> None:
    before = lightmap()
    change_lights()
    follow()
    shown = lightmap()
    assert relative(shown, before) > 0.2
    np.testing.assert_allclose(glowing(), (1.2, 6.0, 2.4), rtol=1e-5)
    settle()
    exact = lightmap()
    assert relative(shown, exact) < 2e-3
    assert not bpy.data.images["room_Scene_lightmap.exr"].is_dirty
    assert live.radiosity_live
    live.radiosity_live = False
    held = kept_bakes.find(bpy.context.scene)
    assert held is not None
    shown_strengths = held.shown
    # The export finds what was read without it.
    assert relight() == {"FINISHED"}
    np.testing.assert_allclose(held.shown, shown_strengths, rtol=1e-6)
    np.testing.assert_allclose(lightmap(), exact, rtol=1e-3, atol=1e-4)


def test_what_it_writes_itself_starts_nothing(live: bpy.types.WindowManager) -> None:
    bpy.data.objects["Bulb"].data.energy *= 1.5
    settle()
    running = session.live
    for _ in range(3):
        bpy.context.view_layer.update()
        assert not running.step(in_background=True)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("move", "object 'Floor' has moved"),
        ("mesh", "object 'Panel'"),
        ("paint", "material 'Glow'"),
        ("lamp", "lamp 'Bulb' has changed in more than its strength"),
        ("forget", "the kept bake is no longer available"),
    ],
)
def test_it_goes_off_where_the_scene_no_longer_fits(
    live: bpy.types.WindowManager, change: str, message: str
) -> None:
    if change == "move":
        bpy.data.objects["Floor"].location.z -= 0.01
    elif change == "mesh":
        mesh = bpy.data.objects["Panel"].data
        mesh.vertices[0].co.x += 0.1
        mesh.update()
    elif change == "paint":
        tree = bpy.data.materials["Glow"].node_tree
        other = tree.nodes.new("ShaderNodeBsdfDiffuse")
        (output,) = (node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
        tree.links.new(other.outputs[0], output.inputs["Surface"])
    elif change == "lamp":
        bpy.data.objects["Bulb"].data.shadow_soft_size = 0.5
    else:
        session.kept_bakes.clear()
        bpy.data.objects["Bulb"].data.energy = 1.0
    settle()
    assert not live.radiosity_live
    assert message in session.live_message
    assert session.live is None


def test_restore_switches_it_off(live: bpy.types.WindowManager) -> None:
    assert bpy.ops.radiosity.restore("EXEC_DEFAULT") == {"FINISHED"}
    assert session.live is None
    assert not live.radiosity_live
    assert session.live_message == ""


def test_undo_takes_the_light_back_with_the_lamp(live: bpy.types.WindowManager) -> None:
    before = lightmap()
    bpy.ops.ed.undo_push(message="on")
    bpy.data.objects["Bulb"].data.energy *= 4.0
    settle()
    bpy.ops.ed.undo_push(message="brighter")
    assert lightmap().mean() > 1.1 * before.mean()
    bpy.ops.ed.undo()
    settle()
    assert relative(lightmap(), before) < 2e-3
    assert bpy.context.window_manager.radiosity_live


def test_a_slider_may_move_before_the_first_exact_light_is_there(saved: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    bpy.context.window_manager.radiosity_live = True
    assert session.live.step(in_background=True), session.live_message
    change_lights()
    bpy.context.view_layer.update()
    while session.live is not None and session.live.step(in_background=True):
        pass
    assert session.live_message == ""
    followed = lightmap()
    bpy.context.window_manager.radiosity_live = False
    assert relight() == {"FINISHED"}
    np.testing.assert_allclose(followed, lightmap(), rtol=1e-3, atol=1e-4)
    session.stop_live()


def test_its_message_goes_with_what_it_is_about(live: bpy.types.WindowManager) -> None:
    def fail() -> None:
        live.radiosity_live = True
        settle()
        bpy.data.objects["Bulb"].location.x += 0.1
        settle()
        assert "Live is off" in session.live_message
        assert not live.radiosity_live
        bpy.data.objects["Bulb"].location.x -= 0.1

    fail()
    assert relight() == {"FINISHED"}
    assert session.live_message == ""
    fail()
    assert bpy.ops.radiosity.restore("EXEC_DEFAULT") == {"FINISHED"}
    assert session.live_message == ""


def test_files_and_pictures_agree_after_undo_and_redo(live: bpy.types.WindowManager) -> None:
    """Also where a step was remembered while only sums were shown."""
    bpy.ops.ed.undo_push(message="on")
    for energy in (150.0, 300.0):
        bpy.data.objects["Bulb"].data.energy = energy
        follow()
        bpy.ops.ed.undo_push(message="dragged")
        settle()
    bpy.ops.ed.undo_push(message="at rest")
    brightest = lightmap()
    for step in (bpy.ops.ed.undo, bpy.ops.ed.undo, bpy.ops.ed.redo, bpy.ops.ed.redo):
        step()
        settle()
        (image,) = lightmap_versions.lightmaps()
        assert image[VERSION] == digest_of_file(Path(bpy.path.abspath(image.filepath_raw)))
        shown = lightmap()
        image.reload()
        np.testing.assert_array_equal(lightmap(), shown)
        assert not lightmap_versions.state.message
    assert relative(lightmap(), brightest) < 2e-3
    live.radiosity_live = False
    bpy.ops.ed.undo()
    (image,) = lightmap_versions.lightmaps()
    assert image[VERSION] == digest_of_file(Path(bpy.path.abspath(image.filepath_raw)))


def test_nothing_is_raised_from_the_handler(
    live: bpy.types.WindowManager, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> bool:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(LiveScene, "note", broken)
    bpy.data.objects["Bulb"].data.energy *= 2.0
    bpy.context.view_layer.update()
    assert says(session.live_message, "Live is off", "ZeroDivisionError", "by zero")
    assert not live.radiosity_live


def test_it_cannot_be_switched_on_without_a_bake(saved: Path) -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.context.window_manager.radiosity_live = True
    settle()
    assert not bpy.context.window_manager.radiosity_live
    assert "no kept bake" in session.live_message


def test_it_ends_with_the_file(live: bpy.types.WindowManager) -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert session.live is None
    assert not bpy.context.window_manager.radiosity_live


def test_emission_that_varies_follows_its_slider(saved: Path, tmp_path: Path) -> None:
    """What only Cycles can tell is taken in proportion to what the constants say."""
    room()
    glow = shader_material("Pattern", "ShaderNodeEmission", Strength=4.0)
    tree = glow.node_tree
    (emission,) = (node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs["Fac"], emission.inputs["Color"])
    bpy.data.objects["Panel"].data.materials[0] = glow
    bpy.context.scene.radiosity.resolution = 16
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT") == {"FINISHED"}
    manager = bpy.context.window_manager
    manager.radiosity_live = True
    settle()
    assert manager.radiosity_live, session.live_message
    emission.inputs["Strength"].default_value = 9.0
    settle()
    shown = lightmap()
    manager.radiosity_live = False
    assert relight() == {"FINISHED"}
    np.testing.assert_allclose(shown, lightmap(), rtol=5e-3, atol=1e-4)
    (slot,) = bpy.data.objects["Panel"].material_slots
    (link,) = lightmap_node(slot.material).inputs[EMISSION].links
    assert link.from_node.type == "VECT_MATH"
    (strength,) = link.from_node.inputs["Scale"].links
    assert strength.from_socket.default_value == 9.0
