"""What the overlays show: for this session alone, no part of the file and of no undo."""

from __future__ import annotations

import bpy

from ...options import EFFICACY
from ..session import facts
from ..session.redraw import redraw_viewports

NONE, FALSE_COLOR, DENSITY, CHECKER, TEXELS, ELEMENTS, LINKS, ERROR = (
    *("NONE", "FALSE_COLOR", "DENSITY", "CHECKER"),
    *("TEXELS", "ELEMENTS", "LINKS", "ERROR"),
)

OF_THE_BAKE = frozenset({TEXELS, ELEMENTS, LINKS, ERROR})
"""What needs the bake in memory; the others need lightmaps and UVs alone."""


def _redraw(_settings: RadiosityOverlay, _context: bpy.types.Context) -> None:
    facts.refresh()
    redraw_viewports()


class RadiosityOverlay(bpy.types.PropertyGroup):
    """`window_manager.radiosity_overlay`."""

    show: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Overlay",
        description="What is drawn over the objects in the 3D viewports",
        items=[
            (NONE, "None", "Nothing"),
            (FALSE_COLOR, "False Color", "The light that the lightmaps hold, as colors with a scale"),
            (DENSITY, "Texel Density", "Lightmap pixels per meter of surface, as colors with a scale"),
            (CHECKER, "Texel Checker", "A checker of the lightmap's pixels"),
            (
                TEXELS,
                "Problem Texels",
                "Texels that geometry divides, occludes or encloses",
            ),
            (ELEMENTS, "Elements", "The elements that the solver divided the surfaces into"),
            (LINKS, "Links", "Where the light on a face comes from, and how much"),
            (ERROR, "Error", "Estimated error of each texel"),
        ],
        default=NONE,
        update=_redraw,
    )
    unit: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Unit",
        description="What light is measured in",
        items=[
            ("LUX", "Lux", "Illuminance: how bright the light looks to the eye, weighted by its color [lx]"),
            ("WATT", "W/m²", "Irradiance: the power that arrives, the mean of red, green and blue [W/m²]"),
        ],
        default="LUX",
        update=_redraw,
    )
    efficacy: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Efficacy",
        description="Lumens per watt of white light. 683 is the maximum, and what glTF lamps use. If powers "
        "are those of real lamps, use theirs: about 15 for a filament, 100 for LEDs",
        default=EFFICACY,
        min=1.0,
        max=EFFICACY,
        update=_redraw,
    )
    automatic: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Automatic Range",
        description="Fit the range of colors to the values that are shown",
        default=True,
        update=_redraw,
    )
    low: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="From", description="Value of the first color", default=0.0, update=_redraw
    )
    high: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="To", description="Value of the last color", default=500.0, update=_redraw
    )
    squares: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Texels per Square",
        description="Width of the checker's squares in lightmap pixels",
        default=1,
        min=1,
        soft_max=16,
        update=_redraw,
    )
    links_of: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Of",
        description="Whose links are shown",
        items=[
            (
                "CURSOR",
                "3D Cursor",
                "The element nearest to the 3D cursor: Shift and right click to place it",
            ),
            (
                "FACE",
                "Active Face",
                "The elements on the active face of the active object, which is chosen in Edit Mode",
            ),
        ],
        default="CURSOR",
        update=_redraw,
    )
    most_links: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Max Links",
        description="Number of links shown: those that carry the most light",
        default=300,
        min=1,
        soft_max=5000,
        max=100000,
        update=_redraw,
    )
    error_of: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Error Of",
        description="Which error is shown",
        items=[
            ("NOISE", "Lightmap", "Estimated noise of a texel's light: more rays reduce it"),
            (
                "ELEMENTS",
                "Elements",
                "How far the solver's element is brighter or darker than the texels on it: more elements "
                "reduce it",
            ),
        ],
        default="NOISE",
        update=_redraw,
    )


def overlay_of(context: bpy.types.Context) -> RadiosityOverlay:
    """Return the session's settings."""
    return context.window_manager.radiosity_overlay


def register() -> None:
    """Register the settings and hang them on the window manager."""
    bpy.utils.register_class(RadiosityOverlay)
    bpy.types.WindowManager.radiosity_overlay = bpy.props.PointerProperty(
        type=RadiosityOverlay, options={"SKIP_SAVE"}
    )


def unregister() -> None:
    """Take the settings away."""
    del bpy.types.WindowManager.radiosity_overlay
    bpy.utils.unregister_class(RadiosityOverlay)
