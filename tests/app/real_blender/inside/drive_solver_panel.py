"""Open the Solver panel in the sidebar and choose each method; photograph two of them.

Usage: blender FILE --enable-event-simulate --python drive_solver_panel.py -- ANSWER.json
"""

import json
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events

ANSWER = Path(sys.argv[sys.argv.index("--") + 1])

seen = {"drawn": {}}


def opened(panel):
    """Have a panel open that comes folded."""
    bpy.utils.unregister_class(panel)
    panel.bl_options = set()
    bpy.utils.register_class(panel)


def noting(panel):
    """Note for each method that its panel was drawn to the end."""
    draw = panel.draw

    def draw_and_note(self, context):
        draw(self, context)
        method = context.scene.radiosity.method
        seen["drawn"][method] = seen["drawn"].get(method, 0) + 1

    panel.draw = draw_and_note


def script():
    panel = bpy.types.RADIOSITY_PT_solver
    noting(panel)
    opened(panel)
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
            events.screenshot(ANSWER.with_name(f"solver-{method}.png"))


def finished(failure):
    seen["failure"] = failure
    ANSWER.write_text(json.dumps(seen, indent=1))


bpy.context.preferences.view.show_splash = False
events.drive(script(), finished)
