"""Light and shadow linking are not followed: whose, and what they ask for, is told."""

from __future__ import annotations

import bpy
import pytest

from tests.blender.exporting import export_with
from tests.blender.scenes import add_lamp, add_mesh, shader_material
from tests.wording import says

KINDS = {
    "receiver_collection": "light linking",
    "blocker_collection": "shadow linking",
}


def link(owner: bpy.types.Object, kind: str, **states: str) -> bpy.types.Collection:
    """Link objects by name; each is included or excluded."""
    collection = bpy.data.collections.new("Linked")
    for name in states:
        collection.objects.link(bpy.data.objects[name])
    for obj, member in zip(collection.objects, collection.collection_objects, strict=True):
        member.light_linking.link_state = states[obj.name]
    setattr(owner.light_linking, kind, collection)
    return collection


def told() -> list[tuple[str, str]]:
    return [
        (warning.name, warning.message)
        for warning in export_with().bake_scene.warnings
        if "linking" in warning.message
    ]


@pytest.fixture
def lamp() -> bpy.types.Object:
    for name in ("Bench", "Chair", "Desk", "Easel", "Fan"):
        add_mesh(name)
    return add_lamp("POINT", "Key", energy=7.0)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("states", "words"),
    [
        ({"Chair": "INCLUDE"}, "only 'Chair'"),
        ({"Desk": "INCLUDE", "Chair": "INCLUDE", "Fan": "EXCLUDE"}, "only 'Chair', 'Desk'"),
        ({"Chair": "EXCLUDE"}, "also 'Chair'"),
        (
            dict.fromkeys(("Bench", "Chair", "Desk", "Easel", "Fan"), "INCLUDE"),
            "only 'Bench', 'Chair', 'Desk' and 2 more",
        ),
    ],
)
def test_a_lamps_linking_is_reported(lamp: bpy.types.Object, kind: str, states: dict, words: str) -> None:
    link(lamp, kind, **states)
    ((name, message),) = told()
    assert name == "Key"
    assert says(message, "Key", KINDS[kind], words)


def test_both_kinds_and_collections_in_the_collection_are_reported(lamp: bpy.types.Object) -> None:
    link(lamp, "receiver_collection", Chair="INCLUDE")
    outer = link(lamp, "blocker_collection")
    inner = bpy.data.collections.new("Inner")
    inner.objects.link(bpy.data.objects["Desk"])
    outer.children.link(inner)
    outer.collection_children[0].light_linking.link_state = "EXCLUDE"
    (_, light), (_, shadow) = told()
    assert says(light, "light linking", "only 'Chair'")
    assert says(shadow, "shadow linking", "also 'Desk'")


def test_an_empty_collection_links_nothing(lamp: bpy.types.Object) -> None:
    """Cycles lights what it lights without one."""
    link(lamp, "receiver_collection")
    link(lamp, "blocker_collection")
    assert told() == []


@pytest.mark.parametrize("kind", KINDS)
def test_an_emissive_objects_linking_is_reported(lamp: bpy.types.Object, kind: str) -> None:
    glowing = bpy.data.objects["Bench"]
    glowing.data.materials.append(shader_material("Glow", "ShaderNodeEmission"))
    link(glowing, kind, Chair="INCLUDE")
    ((name, message),) = told()
    assert name == "Bench"
    assert says(message, "Bench", KINDS[kind], "only 'Chair'")


def test_linking_of_an_object_that_does_not_glow_is_not_reported(lamp: bpy.types.Object) -> None:
    link(bpy.data.objects["Bench"], "receiver_collection", Chair="INCLUDE")
    assert told() == []
