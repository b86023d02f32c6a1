"""The panel's method: what is drawn, and what a bake gets of it."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import pytest

from radiosity_addon.blender.panels import bake_panel
from radiosity_addon.blender.panels.option_rows import draw_options
from radiosity_addon.blender.settings.preferences import Defaults
from radiosity_addon.blender.settings.properties import settings_of
from radiosity_addon.options import METHODS, OPTIONS, PANEL_OPTIONS, SECTIONS, BakeSettings, options_of_method

SETTINGS = {name: option for name, option in OPTIONS.items() if option.methods}


class Layout:
    """Stands for Blender's layout, which needs a window; notes what is drawn."""

    def __init__(self) -> None:
        self.drawn: list[str] = []
        self.by_quality: list[SimpleNamespace] = []

    def column(self, **_: object) -> Layout:
        return self

    row = split = column

    def prop(self, owner: object, name: str, **_: object) -> None:
        assert name in owner.bl_rna.properties
        self.drawn.append(name)

    def label(self, **_: object) -> None:
        pass

    def operator(self, _name: str, text: str, **_: object) -> SimpleNamespace:
        properties = SimpleNamespace(text=text)
        if text:
            self.by_quality.append(properties)
        return properties


@pytest.fixture(autouse=True)
def group(registered: None) -> bpy.types.PropertyGroup:
    """The panel's settings."""
    return bpy.context.scene.radiosity


def drawn() -> list[str]:
    """Names of what the Solver panel shows."""
    layout = Layout()
    bake_panel.SolverSection.draw(layout, bpy.context)
    return layout.drawn


@pytest.mark.parametrize("method", METHODS)
def test_only_what_applies_is_drawn_and_given(method: str, group: bpy.types.PropertyGroup) -> None:
    for name, setting in SETTINGS.items():
        if setting.kind is bool:
            setattr(group, name, True)
        elif setting.kind is not str:
            setattr(group, name, 5 if setting.kind is int else 0.1)
    group.patches = 4
    group.method = method
    applies = [
        name for name in options_of_method(method) if (method, name) != ("conjugate-gradient", "assembly")
    ]
    assert drawn() == ["method", *applies]
    settings = settings_of(bpy.context)
    assert settings.method == method
    # Single precision is made what was typed.
    kinds = {int: 5, float: 0.1, bool: True, str: "galerkin"}
    expected = {name: kinds[SETTINGS[name].kind] for name in applies}
    expected.update({"patches": 4} if "patches" in applies else {})
    assert settings.method_settings() == expected


@pytest.mark.parametrize("method", METHODS)
def test_untouched_settings_come_from_the_quality(method: str, group: bpy.types.PropertyGroup) -> None:
    group.method = method
    given = settings_of(bpy.context).method_settings()
    assert set(given) <= {"assembly"}


@pytest.mark.parametrize("method", METHODS)
def test_a_number_left_to_the_quality_is_a_button_until_it_is_set(
    method: str, group: bpy.types.PropertyGroup
) -> None:
    group.method = method
    layout = Layout()
    bake_panel.SolverSection.draw(layout, bpy.context)
    buttons = {properties.option: properties.text for properties in layout.by_quality}
    names = list(buttons)
    assert set(names) == {name for name in options_of_method(method) if SETTINGS[name].automatic}
    assert not set(names) & set(layout.drawn)
    assert {name for name in names if buttons[name].endswith("preferences")} == {"memory_limit"}
    for name in names:
        bpy.ops.radiosity.set_option(option=name)
        value = getattr(group, name)
        assert value > 0
        assert settings_of(bpy.context).method_settings()[name] == pytest.approx(value)
        bpy.ops.radiosity.set_option(option=name)
        assert not group.is_property_set(name)


@pytest.mark.parametrize(("preferred", "entered"), [(0.0, 4.0), (9.5, 9.5)])
def test_a_memory_limit_starts_from_the_preferences_one(
    group: bpy.types.PropertyGroup, monkeypatch: pytest.MonkeyPatch, preferred: float, entered: float
) -> None:
    monkeypatch.setattr(Defaults, "memory_limit", preferred)
    bpy.ops.radiosity.set_option(option="memory_limit")
    assert group.memory_limit == entered


def test_a_row_that_is_not_shown_has_no_effect(group: bpy.types.PropertyGroup) -> None:
    group.resolution, group.texel_density, group.max_resolution = 100, 12.3, 2048
    group.pages, group.relative_error = 3, 0.1
    assert settings_of(bpy.context) == BakeSettings(resolution=100, pages=3)
    group.atlas = "per-object"
    assert settings_of(bpy.context) == BakeSettings(resolution=100, atlas="per-object")
    group.atlas, group.size_mode, group.quality = "shared", "density", "error"
    expected = BakeSettings(texel_density=12.3, max_resolution=2048, relative_error=0.1)
    assert settings_of(bpy.context) == expected


def test_every_option_of_the_panel_is_drawn_where_its_section_is(group: bpy.types.PropertyGroup) -> None:
    group.size_mode, group.quality = "density", "error"
    expected = {
        option.identifier
        for option in (*PANEL_OPTIONS.values(), *OPTIONS.values())
        if option.panel is not None and not option.methods and option.name not in {"resolution", "pages"}
    }
    layout = Layout()
    for part in set(SECTIONS.values()):
        draw_options(layout, part, bpy.context)
    assert sorted(set(layout.drawn) - SETTINGS.keys()) == sorted(expected)
    assert len(layout.drawn) == len(set(layout.drawn))


def test_the_panel_as_it_comes_bakes_the_defaults() -> None:
    assert settings_of(bpy.context) == BakeSettings()


@pytest.mark.parametrize("name", [name for name, setting in SETTINGS.items() if setting.kind in (int, float)])
def test_a_number_keeps_to_its_range(name: str, group: bpy.types.PropertyGroup) -> None:
    setting = SETTINGS[name]
    group.method = SETTINGS[name].methods[0]
    for value in (2 * setting.limits[1], setting.limits[1]):
        setattr(group, name, min(value, 2**31 - 1) if setting.kind is int else value)
        assert settings_of(bpy.context).method_settings()[name] == pytest.approx(setting.limits[1])
    setattr(group, name, -1)
    assert name not in settings_of(bpy.context).method_settings()


def test_the_assembly_is_given_as_chosen(group: bpy.types.PropertyGroup) -> None:
    group.method, group.assembly = "jacobi", "linear"
    assert settings_of(bpy.context).assembly == "linear"
    group.method = "conjugate-gradient"
    assert settings_of(bpy.context).assembly is None


def test_the_last_bake_reports_how_it_was_solved() -> None:
    from radiosity_addon.blender.session import last_bake

    solver = {
        "method": "gauss-seidel",
        "elements": 1200,
        "links": 34000,
        "rays": 5,
        "iterations": 17,
        "residual": 2.5e-5,
        "independent_sets": [{"objects": ["A"]}, {"objects": ["B"]}],
        "history": [{"seconds": 0.1}] * 100,
    }
    report = {"objects": [], "solver": solver, "seconds": {"solve": 1.0}, "warnings": []}
    last_bake.remember(bpy.context.scene, report, "")
    assert "history" not in bpy.context.scene.radiosity.last_bake
    figures = dict(last_bake.read(bpy.context.scene).figures)
    assert figures["Method"] == "Gauss-Seidel"
    assert figures["Iterations"] == "17"
    assert figures["Residual"] == "2.5e-05"
    assert figures["Separate Parts"] == "2"
