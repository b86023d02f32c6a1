"""The panel's settings, kept with the scene."""

from __future__ import annotations

import bpy

from ...base import UsageError
from ...options import (
    ATLASES,
    FORMATS,
    LIGHTS,
    MAX_ERROR,
    MAX_MIP_LEVELS,
    MAX_PAGES,
    MAX_RESOLUTION,
    MAX_SEED,
    MAX_THREADS,
    MIN_ERROR,
    QUALITIES,
    QUANTITIES,
    BakeSettings,
)
from ..scene_records.object_roles import BAKE, BAKEABLE_TYPES
from .method_properties import MethodProperties, given_settings
from .preferences import DEFAULT_FOLDER, memory_limit_of, threads_of

DEFAULTS = BakeSettings()

SHARED_FIELDS = (
    *("atlas", "quantity", "light", "format"),
    *("max_resolution", "mip_levels", "sky", "keep_uvs", "seed"),
)
"""Settings of the panel that a bake takes as they are."""

_LABELS = {
    "shared": ("Shared", "One image for all objects"),
    "per-object": ("Per Object", "An image for each object"),
    "draft": ("Draft", "Fast: coarse elements and few rays, to judge the light"),
    "medium": ("Medium", "Clean light at a moderate time"),
    "high": ("High", "Fine elements and many rays, for the final bake"),
    "irradiance_over_pi": (
        "Irradiance / π",
        "What Cycles' diffuse bake without color writes: the radiance of a white surface [W/m²/sr]",
    ),
    "irradiance": ("Irradiance", "The light that arrives [W/m²], as three.js adds it"),
    "radiosity": ("Radiosity", "The light that leaves: own emission and what is reflected [W/m²]"),
    "residual": (
        "Residual",
        "The error picture: by how much the solution misses the radiosity equation, signed [W/m²]",
    ),
    "all": ("All", "Direct and indirect light"),
    "direct": ("Direct", "Only the light that comes straight from lamps, emitters and world"),
    "indirect": ("Indirect", "Only the light that was reflected, for lamps that stay dynamic"),
    "exr": ("OpenEXR", "Linear floating point, exact"),
    "png16": ("PNG 16 bit", "Scaled to the brightest texel; the scale is in the report"),
}


BY_ERROR = ("error", "By Error", "As fine as it takes to reach the error below")
"""The quality that is not a preset."""


def _items(values: tuple[str, ...]) -> list[tuple[str, str, str]]:
    return [(value, *_LABELS[value]) for value in values]


# Blender 4.5 and later want paths that start with // declared; 4.2 refuses the word.
_RELATIVE_PATH = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()


def _show_lightmap_only(settings: RadiositySettings, _context: bpy.types.Context) -> None:
    from ..material_copies.lightmap_materials import set_lightmap_only

    set_lightmap_only(settings.lightmap_only)


class RadiositySettings(MethodProperties, bpy.types.PropertyGroup):
    """`scene.radiosity`: what the next bake from the panel does."""

    scope: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Objects",
        description="Which objects get a lightmap; all others still light and block",
        items=[
            ("all", "All", "Every mesh that shows in renders"),
            ("selected", "Selected", "The selected meshes that show in renders"),
            (
                "changed",
                "Changed",
                "Those whose shape, place or reflectance differs from the last bake; others keep their "
                "lightmaps, without new shadows. All, where the light has changed",
            ),
        ],
        default="all",
    )
    size_mode: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Size",
        description="How the size of the lightmaps is chosen",
        items=[
            ("resolution", "Resolution", "Square images of this many pixels"),
            ("density", "Density", "Pixels per metre of surface; the image size follows"),
        ],
        default="resolution",
    )
    resolution: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Resolution",
        description="Width and height of a lightmap in pixels",
        default=DEFAULTS.resolution,
        min=1,
        max=MAX_RESOLUTION,
        soft_min=64,
        soft_max=4096,
        subtype="PIXEL",
    )
    texel_density: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Pixels per Metre",
        description="Lightmap pixels along one metre of surface",
        default=64.0,
        min=0.01,
        soft_min=1.0,
        soft_max=1024.0,
    )
    pages: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Pages",
        description="How many images the objects are shared out over",
        default=DEFAULTS.pages,
        min=1,
        max=MAX_PAGES,
        soft_max=16,
    )
    max_resolution: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Largest Page",
        description="Largest image that a density makes; what does not fit goes to more images",
        default=DEFAULTS.max_resolution,
        min=4,
        max=MAX_RESOLUTION,
        subtype="PIXEL",
    )
    mip_levels: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Mip Levels",
        description="Down to which mip level the lightmap's charts stay apart: each doubles the padding",
        default=DEFAULTS.mip_levels,
        min=0,
        max=MAX_MIP_LEVELS,
    )
    atlas: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Atlas",
        description="How objects share images",
        items=_items(ATLASES),
        default=DEFAULTS.atlas,
    )
    quality: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Quality",
        description="How fine the light is computed",
        items=[*_items(QUALITIES), BY_ERROR],
        default=DEFAULTS.quality,
    )
    relative_error: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Error",
        description="How far the light may be off: RMS, relative to its mean. Texels are lit again, "
        "with more rays, until the estimate is below it",
        default=0.02,
        min=MIN_ERROR,
        max=MAX_ERROR,
        step=0.1,
        precision=3,
    )
    quantity: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Quantity",
        description="What a pixel of the lightmap holds",
        items=_items(QUANTITIES),
        default=DEFAULTS.quantity,
    )
    light: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Light",
        description="Which light goes into the lightmap",
        items=_items(LIGHTS),
        default=DEFAULTS.light,
    )
    format: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Format",
        description="Kind of image file",
        items=_items(FORMATS),
        default=DEFAULTS.format,
    )
    sky: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Sky if Dark",
        description="Add a plain white sky of strength 1 where the scene has no light at all",
        default=DEFAULTS.sky,
    )
    keep_uvs: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Keep Lightmap UVs",
        description="Use an existing UV layer 'Lightmap' as it is instead of unwrapping anew",
        default=DEFAULTS.keep_uvs,
    )
    seed: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Seed",
        description="Same scene, same seed: the same lightmap to the last bit",
        default=DEFAULTS.seed,
        min=0,
        max=MAX_SEED,
    )
    threads: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Threads",
        description="Processor threads to use; 0 uses all. The result does not depend on it",
        default=DEFAULTS.threads,
        min=0,
        max=MAX_THREADS,
        soft_max=64,
    )
    output_folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Folder",
        description="Where the lightmaps are written. A folder beside an unsaved file is not known yet: "
        "the lightmaps are then packed into the file",
        default=DEFAULT_FOLDER,
        subtype="DIR_PATH",
        options=_RELATIVE_PATH,
    )
    use_light_groups: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Light Groups",
        description="Bake a lightmap for each light group as well, which the materials mix: colors and "
        "strengths can then be changed without baking",
        default=DEFAULTS.light_groups,
    )
    show_while_solving: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Show While Solving",
        description="Draw the light over the objects in the viewports while a bake runs, as far as it is "
        "known: the elements while it solves, then the texels",
        default=True,
    )
    show_result: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Show Result",
        description="Switch the viewport from solid to material preview when the bake is done",
        default=True,
    )
    lightmap_only: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Lightmap Only",
        description="Show the lightmaps alone instead of base color × lightmap",
        default=False,
        update=_show_lightmap_only,
    )
    baked_light: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Baked Light",
        description="What lamps and settings were at the last bake",
        options={"HIDDEN"},
    )
    baked_objects: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Baked Objects",
        description="The objects of the last bake, and what their shapes were",
        options={"HIDDEN"},
    )
    last_bake: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Last Bake",
        description="Figures and warnings of the last bake",
        options={"HIDDEN"},
    )


def settings_of(context: bpy.types.Context) -> BakeSettings:
    """Return the scene's settings as a bake takes them.

    Raises
    ------
    UsageError
        If a value is out of range, or nothing is selected where the selection is asked for.
    """
    group = context.scene.radiosity
    chosen = selected_meshes(context) if group.scope == "selected" else None
    if chosen == ():
        raise UsageError("no mesh is selected: select what is to get a lightmap, or switch to All")
    by_density, by_error = group.size_mode == "density", group.quality == BY_ERROR[0]
    return BakeSettings(
        resolution=group.resolution,
        texel_density=group.texel_density if by_density else None,
        quality=DEFAULTS.quality if by_error else group.quality,
        relative_error=group.relative_error if by_error else None,
        pages=group.pages if group.atlas == "shared" and not by_density else 1,
        objects=chosen,
        light_groups=group.use_light_groups,
        **{name: getattr(group, name) for name in SHARED_FIELDS},
        threads=threads_of(context),
        **{"memory_limit": memory_limit_of(context), **given_settings(group)},
    )


def selected_meshes(context: bpy.types.Context) -> tuple[str, ...]:
    """Return the names of the selected objects that show a surface when rendered and are to be baked."""
    from ..stand_ins.stand_ins import source_name

    return tuple(
        source_name(obj)
        for obj in context.view_layer.objects.selected
        if obj.type in BAKEABLE_TYPES and not obj.hide_render and obj.radiosity_mode == BAKE
    )


def register() -> None:
    """Register the settings and hang them on every scene."""
    bpy.utils.register_class(RadiositySettings)
    bpy.types.Scene.radiosity = bpy.props.PointerProperty(type=RadiositySettings)


def unregister() -> None:
    """Take the settings away; what a file holds stays in the file."""
    del bpy.types.Scene.radiosity
    bpy.utils.unregister_class(RadiositySettings)
