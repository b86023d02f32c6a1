"""What must hold of all that the add-on registers: tooltips and poll messages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy
import pytest

import radiosity_addon
from radiosity_addon.blender import registration
from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.operators.polls import Conditional
from radiosity_addon.blender.panels import bake_panel
from radiosity_addon.blender.panels.sections import Section
from radiosity_addon.blender.session.state import session

OPERATORS = [cls for cls in registration.CLASSES if issubclass(cls, bpy.types.Operator)]
PANELS = [cls for cls in registration.CLASSES if issubclass(cls, bpy.types.Panel)]


@pytest.fixture(autouse=True)
def registered(registered: None) -> Iterator[None]:
    yield
    session.running.active = False


def property_groups() -> list[type]:
    """Every group of properties that is ours."""
    found = [cls for cls in bpy.types.PropertyGroup.__subclasses__() if _is_ours(cls)]
    return found + [cls for cls in registration.CLASSES if issubclass(cls, bpy.types.AddonPreferences)]


def _is_ours(cls: type) -> bool:
    return cls.__module__.startswith(radiosity_addon.__name__) and hasattr(cls, "bl_rna")


def rna_type(cls: Any) -> Any:
    """What Blender knows of a class. Of an operator's own, only its function can tell."""
    if not issubclass(cls, bpy.types.Operator):
        return cls.bl_rna
    module, name = cls.bl_idname.split(".")
    return getattr(getattr(bpy.ops, module), name).get_rna_type()


def own_properties(cls: Any) -> Iterator[bpy.types.Property]:
    """The properties a class has of its own: not Blender's, nor those of a base class of Blender's."""
    inherited = {
        name for base in cls.__mro__ if not base.__module__.startswith("radiosity") for name in vars(base)
    }
    inherited |= {
        name
        for base in cls.__mro__
        if not base.__module__.startswith("radiosity")
        for name in getattr(base, "__annotations__", {})
    }
    for prop in rna_type(cls).properties:
        if prop.identifier not in {"rna_type", "name", "bl_idname"} | inherited:
            yield prop


def test_there_is_something_to_test() -> None:
    assert {"RADIOSITY_OT_bake", "RADIOSITY_OT_check"} <= {cls.__name__ for cls in OPERATORS}
    assert len(PANELS) >= 6
    assert {"RadiositySettings", "BakeRecord", "RADIOSITY_AP_preferences"} <= {
        c.__name__ for c in property_groups()
    }


def test_every_property_says_what_it_is_for() -> None:
    missing = []
    for cls in (*property_groups(), *OPERATORS):
        for prop in own_properties(cls):
            if not prop.description:
                missing.append(f"{cls.__name__}.{prop.identifier}")
            items = getattr(prop, "enum_items_static", ())
            missing += [
                f"{cls.__name__}.{prop.identifier}.{i.identifier}" for i in items if not i.description
            ]
    assert missing == []


def test_every_property_hung_on_blenders_types_says_what_it_is_for() -> None:
    missing = []
    for kind in (getattr(bpy.types, name) for name in dir(bpy.types)):
        properties = getattr(getattr(kind, "bl_rna", None), "properties", ())
        ours = [prop for prop in properties if prop.identifier.startswith("radiosity")]
        # A pointer's group says it of each of its own.
        ours = [prop for prop in ours if prop.type != "POINTER" and not prop.description]
        missing += [f"{kind.__name__}.{prop.identifier}" for prop in ours]
    assert missing == []


def test_every_operator_says_what_it_does_and_every_panel_has_a_name() -> None:
    for cls in OPERATORS:
        assert rna_type(cls).description.strip(), cls.__name__
        assert cls.bl_idname.startswith("radiosity."), cls.__name__
        assert cls.bl_label[0].isupper(), cls.__name__
    for cls in PANELS:
        assert cls.bl_label, cls.__name__


def test_every_section_has_a_name_of_its_own() -> None:
    sections = Section.__subclasses__()
    assert {section.__name__ for section in sections} > {
        section.__name__ for section in (*bake_panel.NEXT_BAKE, *bake_panel.RESULT)
    }
    assert len({section.name for section in sections}) == len(sections)
    assert all(section.label and section.name.startswith("radiosity_") for section in sections)


def situations() -> Iterator[str]:
    """Put Blender into the states that operators refuse, one after the other."""
    yield "an empty scene"
    build_cornell_box()
    yield "a scene, nothing selected"
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    bpy.context.scene.collection.objects.link(lamp)
    bpy.context.view_layer.objects.active = lamp
    yield "a lamp is active"
    floor = bpy.data.objects["Floor"]
    bpy.context.view_layer.objects.active = floor
    floor.select_set(True)
    yield "one object is selected"
    bpy.ops.object.mode_set(mode="EDIT")
    yield "a mesh is edited"
    bpy.ops.object.mode_set(mode="OBJECT")
    session.running.active = True
    yield "a bake runs"
    session.running.active = False


def test_every_operator_that_refuses_says_why() -> None:
    silent, refused = [], set()
    for situation in situations():
        for cls in OPERATORS:
            if not issubclass(cls, Conditional):
                continue
            said: list[str] = []
            stub = type(cls.__name__, (), {"poll_message_set": said.append, "conditions": cls.conditions})
            if not Conditional.poll.__func__(stub, bpy.context):
                refused.add(cls.__name__)
                if not said or not said[-1].strip():
                    silent.append(f"{cls.__name__}: {situation}")
    assert silent == []
    assert "RADIOSITY_OT_bake" in refused
