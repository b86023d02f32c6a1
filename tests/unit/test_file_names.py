"""The names of a bake's files: safe everywhere, and different where the bakes are."""

from __future__ import annotations

import itertools

import pytest

from radiosity_addon.files.file_names import (
    MAX_OBJECT,
    PLAIN_NAMES,
    FileNames,
    highest_page,
    is_bake_name,
    sanitized,
    unique_names,
)


def test_the_panel_names_files_after_blend_and_scene() -> None:
    names = FileNames.of_scene("/projects/kitchen.blend", "Scene")
    assert names.report == "kitchen_Scene_report.json"
    assert names.sidecar == "kitchen_Scene_lightmap.relight"
    assert names.shared_pages(2) == ["kitchen_Scene_lightmap"] * 2
    assert names.shared_pages(1, "Day/Night") == ["kitchen_Scene_lightmap_Day_Night"]
    assert names.object_page("Floor") == "kitchen_Scene_Floor_lightmap"
    assert names.object_page("Floor", "Day") == "kitchen_Scene_Floor_lightmap_Day"
    assert FileNames.of_report(names.report) == names
    assert FileNames.of_scene("", "Scene").report == "untitled_Scene_report.json"


def test_the_command_line_keeps_plain_names() -> None:
    assert PLAIN_NAMES.report == "report.json"
    assert PLAIN_NAMES.sidecar == "lightmap.relight"
    assert PLAIN_NAMES.object_page("Floor") == "Floor"


NASTY = [
    "a/b",
    "a\\b",
    "a:b",
    "..",
    ".",
    "",
    "CON",
    "com1.txt",
    "a\0b",
    "x\ny",
    "\udc80",
    " a ",
    "\u202e",
    "é" * 300,
]


@pytest.mark.parametrize("name", NASTY)
def test_any_name_becomes_one_that_every_file_system_takes(name: str) -> None:
    found = sanitized(name)
    assert found == sanitized(name)
    assert found
    assert is_bake_name(f"{found}.exr")
    assert found.strip(" .") == found


def test_names_never_exceed_what_file_systems_take() -> None:
    for char in ("x", "é", "漢", "🙂"):
        long = char * 300
        names = FileNames.of_scene(f"/{long}.blend", long)
        stem = names.object_page(long, long)
        (last,) = unique_names(
            [stem], ".exr", {f"{stem}_{n}".casefold() for n in range(2, 10_000)} | {stem.casefold()}
        )
        assert len(last.encode()) <= 255
        assert len(names.sidecar.encode()) <= 255
        assert len(sanitized(long, MAX_OBJECT).encode()) <= MAX_OBJECT


def test_long_names_that_begin_alike_stay_different() -> None:
    one, other = (FileNames.of_scene(f"/{'scene' * 20}{n}.blend", "S") for n in (1, 2))
    assert one.report != other.report


def test_names_that_differ_only_in_case_or_form_get_different_files() -> None:
    found = unique_names(["Wall", "wall", "Straße", "STRASSE", "e\u0301", "\u00e9"], ".exr", set())
    assert found == ["Wall.exr", "wall_2.exr", "Straße.exr", "STRASSE_2.exr", "e\u0301.exr", "\u00e9_2.exr"]


@pytest.mark.parametrize("prefix", ["", "kitchen_Scene_"])
@pytest.mark.parametrize("ending", [".exr", ".png"])
def test_no_lightmap_has_the_name_of_another_file_of_the_bake(prefix: str, ending: str) -> None:
    names = FileNames(prefix)
    others = {"baked.blend", "preview.png", names.report, names.sidecar}
    objects = ["preview", "PREVIEW", "report", "baked", "lightmap", "report.json", f"{prefix}report"]
    stems = [names.object_page(name, group) for name, group in itertools.product(objects, ("", "preview"))]
    found = unique_names(stems, ending, set(names.reserved(ending)))
    assert {name.lower() for name in found}.isdisjoint({other.lower() for other in others})
    assert len({name.lower() for name in found}) == len(stems)


@pytest.mark.parametrize(
    "name",
    ["", ".", "..", ".a.exr", "a/b.exr", "a\\b.exr", "a", "a.txt", "b.blend", "a\0.exr", "C:a.exr", 3, None],
)
def test_names_of_other_kinds_are_no_bakes(name: object) -> None:
    assert not is_bake_name(name)


def test_pages_are_counted_as_high_as_files_go() -> None:
    assert highest_page([]) == 1
    assert highest_page(["lightmap.exr", "lightmap_7.exr", "photo_20240101.exr", "notes_9.txt"]) == 7


def test_exports_have_names_of_their_own_and_folders_of_engines() -> None:
    for name in (
        "scene.glb",
        "lightmap_2.ktx2",
        "lightmaps.json",
        "viewer.html",
        "godot/radiosity_lightmaps.gd",
    ):
        assert is_bake_name(name)
    for name in (
        "/scene.glb", "index.html", "package.json", "godot/scene.glb", "godot/../a.gd", "../godot/a.gd",
        "godot/.gd",
        "other/a.gd", "godot//a.gd", "/godot/a.gd", "godot/", "a.gd", "godot/a\\b.gd", "C:/a.gd",
    ):  # fmt: skip
        assert not is_bake_name(name)
