"""Open the Solver panel in the sidebar and choose each method; photograph two of them.

Usage: blender FILE --enable-event-simulate --python drive_solver_panel.py -- ANSWER.json
"""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events

MODULE = "bl_ext.user_default.radiosity_addon"

seen = {"drawn": {}}


def noting(section):
    """Note for each method that its section was drawn to the end."""
    draw = section.draw

    def draw_and_note(layout, context):
        draw(layout, context)
        method = context.scene.radiosity.method
        seen["drawn"][method] = seen["drawn"].get(method, 0) + 1

    section.draw = draw_and_note


def script():
    section = importlib.import_module(f"{MODULE}.blender.panels.bake_panel").SolverSection
    section.folded = False
    noting(section)
    yield from events.open_sidebar("Radiosity")
    group = bpy.context.scene.radiosity
    methods = [item.identifier for item in group.bl_rna.properties["method"].enum_items]
    seen["methods"] = methods
    for method in methods:
        bpy.context.scene.radiosity.method = method
        events.area_3d().tag_redraw()
        for area_region in events.area_3d().regions:
            area_region.tag_redraw()
        yield 0.4
        if method in ("hierarchical", "jacobi"):
            events.screenshot(events.ANSWER.with_name(f"solver-{method}.png"))


events.drive(script(), seen)
