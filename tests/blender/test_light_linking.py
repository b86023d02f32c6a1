"""Light and shadow linking are not followed: whose, and what they ask for, is told."""

from __future__ import annotations

import bpy
import pytest

from tests.blender.exporting import export_with
from tests.blender.scenes import add_lamp, add_mesh, shader_material

KINDS = {
    "receiver_collection": "light linking is ignored: it lights everything",
    "blocker_collection": "shadow linking is ignored: everything blocks it",
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
        ({"Chair": "INCLUDE"}, "not only 'Chair'"),
        ({"Desk": "INCLUDE", "Chair": "INCLUDE", "Fan": "EXCLUDE"}, "not only 'Chair', 'Desk'"),
        ({"Chair": "EXCLUDE"}, "also 'Chair'"),
        (
            dict.fromkeys(("Bench", "Chair", "Desk", "Easel", "Fan"), "INCLUDE"),
            "not only 'Bench', 'Chair', 'Desk' and 2 more",
        ),
    ],
)
def test_a_lamps_linking_is_told(lamp: bpy.types.Object, kind: str, states: dict, words: str) -> None:
    link(lamp, kind, **states)
    assert told() == [("Key", f"lamp 'Key': {KINDS[kind]}, {words}")]


def test_both_kinds_and_collections_in_the_collection_are_told(lamp: bpy.types.Object) -> None:
    link(lamp, "receiver_collection", Chair="INCLUDE")
    outer = link(lamp, "blocker_collection")
    inner = bpy.data.collections.new("Inner")
    inner.objects.link(bpy.data.objects["Desk"])
    outer.children.link(inner)
    outer.collection_children[0].light_linking.link_state = "EXCLUDE"
    assert [message.split("everything")[1] for _, message in told()] == [
        ", not only 'Chair'",
        " blocks it, also 'Desk'",
    ]


def test_an_empty_collection_links_nothing(lamp: bpy.types.Object) -> None:
    """Cycles lights what it lights without one."""
    link(lamp, "receiver_collection")
    link(lamp, "blocker_collection")
    assert told() == []


@pytest.mark.parametrize("kind", KINDS)
def test_an_emissive_objects_linking_is_told(lamp: bpy.types.Object, kind: str) -> None:
    glowing = bpy.data.objects["Bench"]
    glowing.data.materials.append(shader_material("Glow", "ShaderNodeEmission"))
    link(glowing, kind, Chair="INCLUDE")
    assert told() == [("Bench", f"emissive object 'Bench': {KINDS[kind]}, not only 'Chair'")]


def test_linking_of_an_object_that_does_not_glow_is_not_told(lamp: bpy.types.Object) -> None:
    link(bpy.data.objects["Bench"], "receiver_collection", Chair="INCLUDE")
    assert told() == []
