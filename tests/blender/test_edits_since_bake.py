"""What an export says of edits since the bake, and that it reads the scene only where there may be some."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import bpy
import pytest

from radiosity_addon.base import drain
from radiosity_addon.blender.exporting import edits_since_bake as compared
from radiosity_addon.blender.scene_export.export import export_steps
from tests.blender.promised import bake, save, show_picture

from .edited_copies import GREEN, constant_of, shader
from .exporting import add_cube


@pytest.fixture
def baked(room: Path) -> Path:
    """A room that was baked and saved: with a picture, an animated object, and a group of nodes."""
    picture = bpy.data.images.new("Picture", 4, 4)
    picture.filepath_raw, picture.file_format = str(room / "picture.png"), "PNG"
    picture.save()
    picture.filepath = "//picture.png"
    show_picture("White", picture)
    twin = bpy.data.objects["Twin A"]
    for frame, height in ((1, 0.5), (20, 0.9)):
        twin.location.z = height
        twin.keyframe_insert("location", frame=frame)
    wall = bpy.data.objects["Wall"]
    wall.shape_key_add(name="Basis")
    wall.shape_key_add(name="Bent").data[0].co.z += 0.2
    bpy.context.scene.world = bpy.data.worlds.new("Sky")
    bpy.context.scene.frame_set(1)
    bake()
    return save(room / "room.blend")


def notes() -> list[str]:
    """What an export would say."""
    return drain(compared.edits_since_bake(bpy.context))


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """The reads of the scene so far."""
    found: list[object] = []

    def steps(*words: object) -> object:
        found.append(words)
        return export_steps(*words)

    monkeypatch.setattr(compared, "export_steps", steps)
    return found


def test_a_file_that_was_not_edited_is_not_read(baked: Path, reads: list[object]) -> None:
    """After the bake, another one, opened again, in another folder, and shown with another look."""
    assert notes() == []
    bake()
    assert notes() == []
    save(baked)
    bpy.ops.wm.open_mainfile(filepath=str(baked))
    assert notes() == []
    moved = shutil.copytree(baked.parent, baked.parent.parent / "moved")
    baked.parent.rename(baked.parent.parent / "gone")
    bpy.ops.wm.open_mainfile(filepath=str(moved / baked.name))
    assert notes() == []
    for look in ("matte", "lightmap", "shine"):
        bpy.context.scene.radiosity.show = look
        bpy.context.view_layer.update()
    bpy.context.scene.radiosity.resolution = 32
    assert notes() == []
    assert not reads


def lamp_of(kind: str) -> Callable[[], object]:
    return lambda: setattr(bpy.data.lights["Lamp"], "type", kind)


def set_in(where: Callable[[], object], name: str, value: object) -> Callable[[], object]:
    return lambda: setattr(where(), name, value)


def in_object(object_name: str, name: str, value: object) -> Callable[[], object]:
    return set_in(lambda: bpy.data.objects[object_name], name, value)


def move_vertex() -> None:
    bpy.data.objects["Floor"].data.vertices[0].co.z += 0.1


def color_of(
    material: Callable[[], bpy.types.Material], name: str = "Base Color", value: object = GREEN
) -> Callable[[], object]:
    """Change an input of a shader, where a copy shows it."""

    def change() -> None:
        socket = shader(material()).inputs[name]
        (constant_of(socket) if socket.is_linked else socket).default_value = value

    return change


def shown_on(name: str) -> Callable[[], bpy.types.Material]:
    return lambda: bpy.data.objects[name].material_slots[0].material


def light(strength: float) -> Callable[[], object]:
    def change() -> None:
        world = bpy.context.scene.world
        if bpy.app.version < (5, 0):
            world.use_nodes = True
        node = next((n for n in world.node_tree.nodes if n.type == "BACKGROUND"), None)
        node.inputs["Strength"].default_value = strength

    return change


def another_lamp() -> None:
    lamp = bpy.data.objects.new("Spot", bpy.data.lights.new("Spot", "SPOT"))
    lamp.data.energy = 10.0
    bpy.context.scene.collection.objects.link(lamp)


def removed(name: str) -> Callable[[], object]:
    return lambda: bpy.data.objects.remove(bpy.data.objects[name])


def excluded() -> None:
    collection = bpy.data.collections.new("Put Away")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects["Wall"])
    bpy.context.scene.collection.objects.unlink(bpy.data.objects["Wall"])
    bpy.context.view_layer.layer_collection.children["Put Away"].exclude = True


EDITS: dict[str, tuple[Callable[[], object], str]] = {
    "moved object": (in_object("Panel", "location", (1.2, -1, 1.8)), "changed since the last bake: 'Panel'"),
    "scaled instance": (
        in_object("Twin B", "scale", (0.3, 0.2, 0.2)),
        "changed since the last bake: 'Twin B'",
    ),
    "mesh": (move_vertex, "changed since the last bake: 'Floor'"),
    "modifier": (
        lambda: setattr(bpy.data.objects["Cube"].modifiers["Mirror"], "use_axis", (True, True, False)),
        "changed since the last bake: 'Cube'",
    ),
    "shape key": (
        lambda: setattr(bpy.data.objects["Wall"].data.shape_keys.key_blocks["Bent"], "value", 0.5),
        "changed since the last bake: 'Wall'",
    ),
    "frame": (lambda: bpy.context.scene.frame_set(20), "changed since the last bake: 'Twin A'"),
    "parent": (in_object("Twin B", "parent", None), ""),
    "color, on the copy": (color_of(shown_on("Wall")), "changed since the last bake: 'Wall'"),
    "color, of the original": (
        color_of(lambda: bpy.data.materials["Red"]),
        "changed since the last bake: 'Wall'",
    ),
    "emission, on the copy": (
        color_of(shown_on("Panel"), "Emission Strength", 0.2),
        "changed since the last bake: 'Panel'",
    ),
    "other material": (
        lambda: setattr(bpy.data.objects["Wall"].material_slots[0], "material", bpy.data.materials["White"]),
        "changed since the last bake: 'Wall'",
    ),
    "new object": (lambda: add_cube("Box", location=(1, 1, 1)), "added since the last bake: 'Box'"),
    "removed object": (removed("Wall"), "removed since the last bake: 'Wall'"),
    "hidden object": (in_object("Wall", "hide_render", True), "removed since the last bake: 'Wall'"),
    "ignored object": (in_object("Wall", "radiosity_mode", "IGNORE"), "changed since the last bake: 'Wall'"),
    "excluded object": (excluded, "removed since the last bake: 'Wall'"),
    "renamed object": (in_object("Wall", "name", "Old Wall"), ""),
    "moved lamp": (in_object("Lamp", "location", (0, 0, 1.6)), "changed since the last bake: 'Lamp'"),
    "power of a lamp": (
        set_in(lambda: bpy.data.lights["Lamp"], "energy", 50.0),
        "changed since the last bake: 'Lamp'",
    ),
    "color of a lamp": (
        set_in(lambda: bpy.data.lights["Lamp"], "color", (1.0, 0.5, 0.2)),
        "changed since the last bake: 'Lamp'",
    ),
    "kind of a lamp": (lamp_of("SUN"), "changed since the last bake: 'Lamp'"),
    "renamed lamp": (in_object("Lamp", "name", "Bulb"), ""),
    "new lamp": (another_lamp, "added since the last bake: 'Spot'"),
    "removed lamp": (removed("Lamp"), "removed since the last bake: 'Lamp'"),
    "world": (light(3.0), "changed since the last bake: 'Sky'"),
    "dark world": (light(0.0), "removed since the last bake: 'Sky'"),
}


@pytest.mark.one_blender
@pytest.mark.parametrize("edit", EDITS)
def test_edits_are_named(baked: Path, edit: str) -> None:
    """In the file that was baked, and once it was saved and opened again."""
    change, expected = EDITS[edit]
    change()
    bpy.context.view_layer.update()
    ends = "; the lightmaps show their light of before: bake again"
    said = [f"{expected}{ends}"] if expected else []
    assert [note for note in notes() if "since the last bake" in note] == said
    bpy.ops.wm.open_mainfile(filepath=str(baked))
    change()
    save(baked)
    bpy.ops.wm.open_mainfile(filepath=str(baked))
    assert [note for note in notes() if "since the last bake" in note] == said


def test_a_picture_that_was_painted_is_named(baked: Path) -> None:
    picture = baked.parent / "picture.png"
    other = bpy.data.images.new("Other", 4, 4)
    other.pixels.foreach_set([0.9, 0.1, 0.1, 1.0] * 16)
    other.filepath_raw, other.file_format = str(picture), "PNG"
    other.save()
    os.utime(picture, ns=(10**18, 10**18))
    bpy.ops.wm.open_mainfile(filepath=str(baked))
    (note,) = notes()
    assert note.startswith("changed since the last bake: 'Floor'; ")
    bpy.data.images["Picture"].pixels[0] = 0.5  # not saved
    (note,) = notes()
    assert note.startswith("changed since the last bake: 'Floor'; ")


def test_what_no_bake_reads_is_compared_once(baked: Path, reads: list[object]) -> None:
    bpy.context.scene.collection.children.link(bpy.data.collections.new("Empty"))
    assert notes() == []
    assert len(reads) == 1
    assert notes() == []
    assert len(reads) == 1


def test_lights_of_a_relit_bake_may_have_other_strengths(room: Path) -> None:
    bpy.context.scene.radiosity_relight.keep = True
    bake()
    bpy.data.lights["Lamp"].energy = 30.0
    assert notes() != []
    assert bpy.ops.radiosity.relight("EXEC_DEFAULT", True) == {"FINISHED"}
    assert notes() == []
    bpy.data.objects["Lamp"].location.x += 0.5
    bpy.context.view_layer.update()
    (note,) = notes()
    assert note.startswith("changed since the last bake: 'Lamp'; ")


def test_what_a_bake_of_changed_objects_leaves_is_still_named(room: Path) -> None:
    bpy.context.scene.radiosity_relight.keep = False  # a kept bake would be updated for what moved
    bpy.data.objects["Wall"].radiosity_mode = "LIGHT_ONLY"
    bake()
    bpy.data.objects["Wall"].location.y += 0.2
    bpy.data.objects["Cube"].location.x += 0.1
    bpy.context.view_layer.update()
    bpy.context.scene.radiosity.scope = "changed"
    bake()
    (note,) = notes()
    assert note.startswith("changed since the last bake: 'Wall'; ")
    bpy.context.scene.radiosity.scope = "all"
    bake()
    assert notes() == []


def test_scenes_are_compared_with_bakes_of_their_own(room: Path, reads: list[object]) -> None:
    first, second = bpy.context.scene, bpy.data.scenes.new("Second")
    bake()
    bpy.context.window.scene = second
    floor = bpy.data.objects["Floor"].copy()
    floor.data = floor.data.copy()
    second.collection.objects.link(floor)
    lamp = bpy.data.objects["Lamp"].copy()
    lamp.data = lamp.data.copy()
    second.collection.objects.link(lamp)
    second.radiosity.resolution, second.radiosity.quality = 16, "sketch"
    for energy in (20.0, 40.0):
        lamp.data.energy = energy
        bake()
        assert notes() == []
    assert not reads
    bpy.context.window.scene = first
    assert notes() == []
    assert len(reads) == 1, "the file holds more now"
    bpy.data.lights["Lamp"].energy = 1.0
    (note,) = notes()
    assert note.startswith("changed since the last bake: 'Lamp'; ")
