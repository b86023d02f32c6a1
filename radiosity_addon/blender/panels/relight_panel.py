"""The section *Relight*, and in it the lights of a kept bake with what can be changed of them."""

from __future__ import annotations

from typing import Any

import bpy

from ..relight import kept_bakes, lightmap_versions
from ..session.state import session
from .sections import Section, draw_sections
from .wrapped_text import draw_text

SHOWN_LIGHTS = 16


class RelightSection(Section):
    """Other light without another bake."""

    name = "radiosity_relight"
    label = "Relight"
    folded = False

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw what Live has to say, and what is kept of the next bake."""
        chosen = context.scene.radiosity_relight
        if session.live_message:
            draw_text(layout.box(), session.live_message, "ERROR", context)
        if lightmap_versions.state.message:
            draw_text(layout.box(), lightmap_versions.state.message, "ERROR", context)
        layout.use_property_split = True
        column = layout.column(heading="Next Bake")
        column.prop(chosen, "keep")
        column.prop(chosen, "sidecar")
        column.prop(chosen, "only_moved")
        draw_sections(layout, (RelightLightsSection,), context)


class RelightLightsSection(Section):
    """What of the kept bake's lights can be changed."""

    name = "radiosity_relight_lights"
    label = "Lights"
    folded = False

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show them while a bake is kept."""
        return kept_bakes.find(context.scene) is not None

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw each light's strength and color."""
        from ..materials.light_inputs import inputs_of

        held = kept_bakes.find(context.scene)
        if held is None:
            return
        lights = len(held.bake.sources.lights)
        named = list(dict.fromkeys((name, row >= lights) for row, name in enumerate(held.bake.names)))
        for name, emits in named[:SHOWN_LIGHTS]:
            inputs = inputs_of(context.scene, name, emits)
            row = layout.row(align=True)
            row.label(text=name, icon=inputs.icon if inputs else "ERROR", translate=False)
            _draw_inputs(row, inputs)
        if len(named) > SHOWN_LIGHTS:
            layout.label(text=f"and {len(named) - SHOWN_LIGHTS} more")


def _draw_inputs(row: Any, inputs: Any) -> None:
    """Draw what of one light can be changed; nothing where nodes feed it."""
    if inputs is None:
        return
    for owner, attribute in inputs.color, inputs.strength:
        if owner is not None:
            row.prop(owner, attribute, text="")
