"""A new option of the table is in Blender too: property, row of the panel, presets, and what a bake gets."""

from __future__ import annotations

import json
from pathlib import Path

from tests import worked_example

PANEL = """
import json, os, sys
from pathlib import Path
import bpy
import radiosity_addon
from radiosity_addon.blender.panels import bake_panel
from radiosity_addon.blender.settings.properties import settings_of
from tests.blender.test_method_properties import Layout

radiosity_addon.register()
group = bpy.context.scene.radiosity
prop = group.bl_rna.properties["exposure"]
layout = Layout()
bake_panel.AdvancedSection.draw(layout, bpy.context)
group.exposure = 1.5
presets = Path(sys.argv[1])
bpy.utils.user_resource = lambda _kind, path="", **_: str(presets)
bpy.ops.radiosity.preset_add(name="Mine")
(preset,) = presets.glob("*.py")
shipped = str(Path(bake_panel.__file__).parents[1] / "settings/presets/radiosity/Draft.py")
found = {
    "range": [prop.hard_min, prop.hard_max, prop.default],
    "label": prop.name,
    "drawn": layout.drawn,
    "bake": settings_of(bpy.context).exposure,
    "preset": preset.read_text(),
}
bpy.ops.script.execute_preset(filepath=shipped, menu_idname="RADIOSITY_PT_presets")
found["reset"] = group.exposure
bpy.ops.script.execute_preset(filepath=str(preset), menu_idname="RADIOSITY_PT_presets")
found["restored"] = group.exposure
print("found:", json.dumps(found), flush=True)
os._exit(0)
"""


def test_property_row_preset_and_bake_have_it(tmp_path: Path) -> None:
    copy, presets = tmp_path / "copy", tmp_path / "presets"
    presets.mkdir()
    worked_example.changed_copy(copy)
    output = worked_example.run(copy, "-c", PANEL, str(presets))
    (line,) = [line for line in output.splitlines() if line.startswith("found: ")]
    found = json.loads(line.removeprefix("found: "))
    assert (found["label"], found["range"]) == ("Exposure", [-10.0, 10.0, 0.0])
    assert "exposure" in found["drawn"]
    assert found["bake"] == 1.5
    assert "settings.exposure = 1.5" in found["preset"]
    assert (found["reset"], found["restored"]) == (0.0, 1.5)
