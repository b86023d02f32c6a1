"""Presets, single objects' choices, and the add-on's preferences."""

from __future__ import annotations

import ast
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import pytest

from radiosity_addon.blender.settings import preferences, preset_menu
from radiosity_addon.blender.settings.preferences import output_folder
from radiosity_addon.blender.settings.preset_menu import FOLDER, PRESET_PROPERTIES
from radiosity_addon.blender.settings.properties import settings_of
from tests.blender.scenes import add_lamp, add_mesh

pytestmark = pytest.mark.usefixtures("registered")

PRESETS = sorted((Path(preset_menu.__file__).parent / "presets" / FOLDER).glob("*.py"))


def values() -> dict[str, Any]:
    """All settings of the scene."""
    group = bpy.context.scene.radiosity
    names = [prop.identifier for prop in group.bl_rna.properties if prop.identifier != "rna_type"]
    return {name: getattr(group, name) for name in names}


def odd_values() -> None:
    """Set every property to something that is not its default."""
    group = bpy.context.scene.radiosity
    for prop in group.bl_rna.properties:
        if prop.identifier in {"rna_type", "name", "show", "lightmap_only"} or prop.is_readonly:
            continue
        before = getattr(group, prop.identifier)
        if prop.type == "ENUM":
            others = [item.identifier for item in prop.enum_items if item.identifier != before]
            setattr(group, prop.identifier, others[0])
        elif prop.type == "BOOLEAN":
            setattr(group, prop.identifier, not before)
        elif prop.type == "INT":
            setattr(group, prop.identifier, before + 3)
        elif prop.type == "FLOAT":
            setattr(group, prop.identifier, before * 0.5 + 0.0123)
        elif prop.type == "STRING":
            setattr(group, prop.identifier, "odd")


def execute(path: Path) -> None:
    bpy.ops.script.execute_preset(filepath=str(path), menu_idname="RADIOSITY_PT_presets")


def test_files_know_a_quality_by_the_number_it_has_had() -> None:
    items = bpy.context.scene.radiosity.bl_rna.properties["quality"].enum_items
    assert [item.identifier for item in items] == ["sketch", "draft", "medium", "high", "error"]
    numbers = {"draft": 0, "medium": 1, "high": 2, "error": 3, "sketch": 4}
    assert {item.identifier: item.value for item in items} == numbers


def test_there_are_five_presets_and_blender_finds_them() -> None:
    assert [path.stem for path in PRESETS] == ["Draft", "Exterior", "Final", "Interior", "Sketch"]
    assert str(PRESETS[0].parent) in bpy.utils.preset_paths(FOLDER)


@pytest.mark.parametrize("path", PRESETS, ids=lambda path: path.stem)
def test_a_preset_sets_what_it_names_and_resets_the_rest_of_what_presets_set(path: Path) -> None:
    defaults = values()
    named = {
        node.targets[0].attr: ast.literal_eval(node.value)
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Attribute)
    }
    assert named.keys() <= set(PRESET_PROPERTIES)
    odd_values()
    before = values()
    execute(path)
    of_presets = {name: defaults[name] for name in PRESET_PROPERTIES}
    assert values() == {**before, **of_presets, **named}


def test_the_users_own_presets_come_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bpy.utils, "user_resource", lambda _kind, path="", **_: _folder(tmp_path / path))
    group = bpy.context.scene.radiosity
    group.resolution, group.quality, group.seed = 333, "high", 7
    assert bpy.ops.radiosity.preset_add(name="Mine") == {"FINISHED"}
    (written,) = (tmp_path / "presets" / FOLDER).glob("*.py")
    group.resolution, group.quality, group.seed = 64, "draft", 8
    execute(written)
    assert (group.resolution, group.quality, group.seed) == (333, "high", 8)


def _folder(path: Path) -> str:
    path.mkdir(parents=True, exist_ok=True)
    return str(path)


def test_the_active_objects_choices_are_given_to_the_selected() -> None:
    source, one, other = (add_mesh(name) for name in ("Source", "One", "Other"))
    lamp = add_lamp("POINT")
    for obj in (source, one, lamp):
        obj.select_set(True)
    bpy.context.view_layer.objects.active = source
    source.radiosity_mode, source.radiosity_texel_scale = "LIGHT_ONLY", 3.0
    source.radiosity_lightmap_page, one.radiosity_texel_scale = 2, 0.5
    assert bpy.ops.radiosity.copy_overrides() == {"FINISHED"}
    assert (one.radiosity_mode, one.radiosity_texel_scale) == ("LIGHT_ONLY", 3.0)
    assert one.radiosity_lightmap_page == 2
    assert (other.radiosity_mode, other.radiosity_texel_scale) == ("BAKE", 1.0)
    assert not lamp.is_property_set("radiosity_mode")
    source.property_unset("radiosity_mode")
    source.property_unset("radiosity_texel_scale")
    bpy.ops.radiosity.copy_overrides()
    assert not one.is_property_set("radiosity_mode")
    assert not one.is_property_set("radiosity_texel_scale")


def test_copying_to_nobody_is_refused() -> None:
    source = add_mesh("Source")
    source.select_set(True)
    bpy.context.view_layer.objects.active = source
    assert not bpy.ops.radiosity.copy_overrides.poll()


@pytest.fixture
def preferred(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> SimpleNamespace:
    chosen = SimpleNamespace(
        output_folder=str(tmp_path / "all"), memory_limit=2.5, threads=3, check_first=False
    )
    monkeypatch.setattr(preferences, "preferences", lambda _context: chosen)
    return chosen


def test_preferences_count_where_the_scene_says_nothing(preferred: SimpleNamespace, tmp_path: Path) -> None:
    settings = settings_of(bpy.context)
    assert (settings.threads, settings.memory_limit) == (3, 2.5)
    assert output_folder(bpy.context) == (tmp_path / "all").resolve()


def test_the_scenes_own_choices_win(preferred: SimpleNamespace, tmp_path: Path) -> None:
    group = bpy.context.scene.radiosity
    group.threads, group.memory_limit, group.output_folder = 1, 1.5, str(tmp_path / "own")
    settings = settings_of(bpy.context)
    assert (settings.threads, settings.memory_limit) == (1, 1.5)
    assert output_folder(bpy.context) == (tmp_path / "own").resolve()
    # Zero threads, all of them, is a choice as well.
    group.threads = 0
    assert settings_of(bpy.context).threads == 0


def test_without_an_installed_add_on_there_are_the_defaults() -> None:
    assert preferences.preferences(bpy.context).threads == 0
    assert settings_of(bpy.context).memory_limit is None
