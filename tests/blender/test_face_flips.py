"""*Flip Faces*: faces that a bake or Check found turned are flipped, on the user's meshes, and no others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from radiosity_addon.blender.apply.restore import restore_scene
from radiosity_addon.blender.operators.panel_facts import FacesToFlip, faces_to_flip
from radiosity_addon.blender.panels.bake_panel import WarningsSection
from radiosity_addon.blender.panels.check_panel import CheckSection
from radiosity_addon.blender.session import last_bake
from radiosity_addon.blender.session.turned_faces import TurnedFaces
from radiosity_addon.blender.stand_ins.stand_ins import is_edited, own_mesh, stand_in_of
from tests.blender.note_layout import NoteLayout, Notes, labels
from tests.blender.scenes import add_lamp, add_mesh

pytestmark = pytest.mark.usefixtures("registered")

CUBE = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
OUTWARD = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
INWARD = [face[::-1] for face in OUTWARD]


@pytest.fixture(autouse=True)
def floor(registered: None) -> None:
    """A lit floor that is as it should be, and quick bakes."""
    add_mesh("Floor", scale=(9, 9, 1))
    add_lamp("POINT", energy=900.0, transform={"location": (0, -7, 6)})
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.quality = 32, "sketch"


def two_boxes(name: str = "Boxes", **transform: object) -> bpy.types.Object:
    """An object of two boxes, of which the second is inside out: polygons 6 to 11."""
    other = [(x + 3, y, z) for x, y, z in CUBE]
    faces = [*OUTWARD, *(tuple(8 + corner for corner in face) for face in INWARD)]
    return add_mesh(name, [*CUBE, *other], faces, **{"location": (0, 0, 2), **transform})


def box(name: str, faces: Sequence[Sequence[int]] = INWARD, x: float = 0.0) -> bpy.types.Object:
    return add_mesh(name, CUBE, faces, location=(x, 0, 2))


def same_mesh(name: str, other: bpy.types.Object, x: float) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, other.data)
    obj.location = (x, 0, 2)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def bake() -> None:
    assert bpy.ops.radiosity.bake() == {"FINISHED"}


def check() -> None:
    assert bpy.ops.radiosity.check() == {"FINISHED"}


def flip(**options: bool) -> set[str]:
    return bpy.ops.radiosity.flip_turned_faces(**options)


def found() -> tuple[tuple[str, ...], ...]:
    """What can be flipped by the last bake, and by the last check."""
    return tuple(each.found for each in faces_to_flip(bpy.context))


def facing(obj: bpy.types.Object) -> list[float]:
    """Whether polygons of an object's own mesh face away from the center of their box: 1, or −1."""
    mesh = own_mesh(obj)
    signs = []
    for polygon in mesh.polygons:
        center = np.array([3.0 if polygon.center.x > 1.5 else 0.0, 0.0, 0.0])
        signs.append(round(float(np.dot(polygon.normal, np.array(polygon.center) - center))))
    return signs


def turned_warnings() -> list[str]:
    last = last_bake.read(bpy.context.scene)
    return [name for name, message in last.warnings if "inside out" in message or "behind" in message]


@pytest.mark.parametrize("look", [bake, check])
def test_just_the_turned_part_is_flipped_and_is_right_in_the_next_bake(look: Callable[[], None]) -> None:
    boxes = two_boxes()
    look()
    assert {name for names in found() for name in names} == {"Boxes"}
    assert facing(boxes) == [1] * 6 + [-1] * 6
    assert flip() == {"FINISHED"}
    assert facing(boxes) == [1] * 12
    assert found() == ((), ())
    bake()
    assert turned_warnings() == []
    assert flip() == {"CANCELLED"}
    assert facing(boxes) == [1] * 12


def test_what_is_lit_from_behind_only_is_found_by_the_bake_alone() -> None:
    wall = add_mesh("Wall", [(-6, 3, 0.1), (6, 3, 0.1), (6, 3, 5), (-6, 3, 5)], [(3, 2, 1, 0)])
    check()
    assert found() == ((), ())
    bake()
    assert turned_warnings() == ["Wall"]
    assert flip() == {"FINISHED"}
    assert wall.data.polygons[0].normal.y == pytest.approx(-1.0)
    bake()
    assert turned_warnings() == []


def test_the_warning_tells_of_the_button() -> None:
    two_boxes()
    bake()
    (message,) = (message for name, message in last_bake.read(bpy.context.scene).warnings if name == "Boxes")
    assert message.startswith("object 'Boxes' is inside out on 50% of its surface: ")
    assert "Flip Faces" in message


def drawn(section: type) -> tuple[list[str], str]:
    """The operators that a section of the panel draws, and its text."""
    notes: Notes = []
    section.draw(NoteLayout(notes), bpy.context)
    return [args[0] for name, args, _ in notes if name == "operator"], " ".join(labels(notes))


def test_the_buttons_are_above_the_warnings_and_then_a_hint() -> None:
    two_boxes()
    check()
    bake()
    buttons = ["radiosity.flip_turned_faces", "radiosity.select_turned_faces"]
    for section in (WarningsSection, CheckSection):
        assert drawn(section)[0] == buttons
    flip()
    names, text = drawn(WarningsSection)
    assert names == []
    assert text.startswith("Faces of 'Boxes' were flipped or edited since: bake again")
    assert "since: bake or check again" in drawn(CheckSection)[1]
    bake()
    assert not WarningsSection.poll(bpy.context) or "since" not in drawn(WarningsSection)[1]


def test_undo_brings_faces_and_button_back() -> None:
    two_boxes()
    bake()
    bpy.ops.ed.undo_push(message="baked")
    flip()
    bpy.ops.ed.undo_push(message="flipped")
    assert found()[0] == ()
    bpy.ops.ed.undo()
    assert facing(bpy.data.objects["Boxes"]) == [1] * 6 + [-1] * 6
    assert found()[0] == ("Boxes",)
    bpy.ops.ed.redo()
    assert facing(bpy.data.objects["Boxes"]) == [1] * 12
    assert found()[0] == ()


def test_faces_are_known_after_the_file_was_saved_and_opened(tmp_path: Path) -> None:
    two_boxes()
    bake()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "boxes.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "boxes.blend"))
    assert flip() == {"FINISHED"}
    assert facing(bpy.data.objects["Boxes"]) == [1] * 12


@pytest.mark.parametrize("edit", ["flipped", "moved vertex", "turned", "replaced"])
def test_an_object_that_was_edited_is_left_alone(edit: str) -> None:
    """Its faces may have other numbers, or face elsewhere. To move it is no such edit."""
    boxes, other = two_boxes(), box("Other", x=-5)
    bake()
    other.location.y += 2.0
    if edit == "flipped":
        boxes.data.flip_normals()
    elif edit == "moved vertex":
        boxes.data.vertices[0].co.x -= 0.1
    elif edit == "turned":
        boxes.rotation_euler.z = np.pi
    else:
        # Of the same name and order of corners, and mirrored, so that all of it is right.
        mesh = boxes.data.copy()
        mesh.transform(Matrix.Scale(-1.0, 4, (1.0, 0.0, 0.0)))
        bpy.data.objects.remove(boxes)
        boxes = bpy.data.objects.new("Boxes", mesh)
        bpy.context.collection.objects.link(boxes)
    bpy.context.view_layer.update()
    before = facing(boxes)
    assert faces_to_flip(bpy.context)[0] == FacesToFlip(("Other",), ("Boxes",))
    flip()
    assert facing(boxes) == before
    assert facing(other) == [1] * 6


def test_objects_that_are_gone_or_renamed_are_not_asked_for() -> None:
    boxes, other = two_boxes(), box("Other", x=-5)
    bake()
    bpy.data.objects.remove(other)
    boxes.name = "Renamed"
    assert faces_to_flip(bpy.context)[0] == FacesToFlip()
    assert flip() == {"CANCELLED"}


def test_only_selected_objects_are_flipped_on_request() -> None:
    first, second = box("First"), box("Second", x=4)
    bake()
    first.select_set(False)
    second.select_set(True)
    assert flip(only_selected=True) == {"FINISHED"}
    assert (facing(first), facing(second)) == ([-1] * 6, [1] * 6)
    assert found()[0] == ("First",)


def test_objects_that_share_a_mesh_turn_together() -> None:
    """Once, with their stand-ins, which do not count as edited."""
    first = box("First")
    second = same_mesh("Second", first, 4)
    bake()
    assert first.data != second.data
    assert flip() == {"FINISHED"}
    assert facing(first) == [1] * 6
    for obj in (first, second):
        assert np.dot(obj.data.polygons[0].normal, obj.data.polygons[0].center) > 0
        assert not is_edited(obj.data, stand_in_of(obj.data))
    restored = restore_scene(bpy.context, bpy.context.scene)
    assert restored.warnings == ()
    assert first.data == second.data
    assert facing(first) == [1] * 6


def refused(text: str) -> None:
    """Flipping is refused in one line with this text."""
    with pytest.raises(RuntimeError) as raised:
        flip()
    (line,) = [line for line in str(raised.value).splitlines() if line.strip()]
    assert text in line


def test_a_mesh_that_another_object_shows_from_its_front_is_refused() -> None:
    first = box("First")
    same_mesh("Hidden", first, 4).hide_render = True
    bake()
    refused("'Hidden' shares its mesh and was not found turned")
    assert facing(first) == [-1] * 6


def test_instances_turn_with_their_object_if_all_are_turned() -> None:
    collection = bpy.data.collections.new("Set")
    first = add_mesh("First", CUBE, INWARD, collection=collection)
    for x in (0.0, 4.0):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", collection, (x, 0, 2)
        bpy.context.scene.collection.objects.link(empty)
    bake()
    assert len(turned_warnings()) == 2
    assert flip() == {"FINISHED"}
    assert facing(first) == [1] * 6
    bake()
    assert turned_warnings() == []


def test_what_modifiers_make_turns_as_a_whole() -> None:
    obj = box("Rounded")
    obj.modifiers.new("Round", "BEVEL").width = 0.2
    obj.modifiers.new("Thin", "TRIANGULATE")
    bake()
    assert turned_warnings() == ["Rounded"]
    assert flip() == {"FINISHED"}
    assert facing(obj) == [1] * 6
    assert not is_edited(obj.data, stand_in_of(obj.data))
    restore_scene(bpy.context, bpy.context.scene)
    assert facing(obj) == [1] * 6
    bake()
    assert turned_warnings() == []


def test_a_part_of_what_modifiers_make_is_refused() -> None:
    two_boxes().modifiers.new("Round", "BEVEL")
    bake()
    refused("only some are turned")


@pytest.mark.parametrize("kind", ["DISPLACE", "SHRINKWRAP"])
def test_modifiers_that_work_along_normals_are_refused(kind: str) -> None:
    obj = box("Moved")
    obj.modifiers.new("Along", kind)
    bake()
    refused("modifier 'Along' works differently on flipped faces")
    assert facing(obj) == [-1] * 6


def test_an_object_whose_instance_shows_its_front_is_refused() -> None:
    collection = bpy.data.collections.new("Set")
    upright = [(-4, 0, -1.9), (4, 0, -1.9), (4, 0, 2), (-4, 0, 2)]
    wall = add_mesh("Wall", upright, [(3, 2, 1, 0)], collection=collection)
    for y, turn in ((3.0, 0.0), (4.0, np.pi)):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
        empty.location, empty.rotation_euler = (-5 if turn else 5, y, 2), (0, 0, turn)
        bpy.context.scene.collection.objects.link(empty)
    bake()
    assert turned_warnings() == ["Instance/Wall"]
    refused("an instance of it shows the front of its faces")
    assert wall.data.polygons[0].normal.y == pytest.approx(1.0)


def test_what_is_no_mesh_is_refused() -> None:
    curve = bpy.data.objects.new("Curve", bpy.data.curves.new("Curve", "CURVE"))
    bpy.context.scene.collection.objects.link(curve)
    solver = {"method": "hierarchical", "elements": 1, "links": 1, "rays": 1}
    report = {"objects": [], "solver": solver, "seconds": {}, "warnings": []}
    faces = TurnedFaces("Curve", ((0, 1),), True, True, False, "")
    last_bake.remember(bpy.context.scene, report, "", [faces])
    refused("'Curve' is no mesh: convert it")


def library_of(tmp_path: Path, *names: str) -> Path:
    """Write objects into another file and remove them here."""
    path = tmp_path / "library.blend"
    bpy.data.libraries.write(str(path), {bpy.data.objects[name] for name in names})
    for name in names:
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.data.orphans_purge()
    return path


def test_linked_meshes_and_overrides_are_refused(tmp_path: Path) -> None:
    box("Box")
    with bpy.data.libraries.load(str(library_of(tmp_path, "Box")), link=True) as (_, wanted):
        wanted.objects = ["Box"]
    (linked,) = wanted.objects
    bpy.context.scene.collection.objects.link(linked)
    own = linked.override_create(remap_local_usages=True)
    bake()
    assert turned_warnings() == [own.name]
    refused("its mesh is linked from")
    restore_scene(bpy.context, bpy.context.scene)
    own.data = own.data.override_create()
    check()
    refused("its mesh is a library override")


def test_selecting_shows_the_faces_in_edit_mode_from_where_nothing_is_flipped() -> None:
    """Undo in Edit Mode would bring back the meshes that are edited alone."""
    boxes = two_boxes()
    bake()
    assert bpy.ops.radiosity.select_turned_faces() == {"FINISHED"}
    assert [polygon.index for polygon in boxes.data.polygons if polygon.select] == list(range(6, 12))
    assert [obj.name for obj in bpy.context.view_layer.objects.selected] == ["Boxes"]
    assert bpy.context.view_layer.objects.active == boxes
    bpy.ops.object.mode_set(mode="EDIT")
    assert boxes.data.total_face_sel == 6
    for operator in (bpy.ops.radiosity.select_turned_faces, bpy.ops.radiosity.flip_turned_faces):
        assert not operator.poll()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert facing(boxes) == [1] * 6 + [-1] * 6
