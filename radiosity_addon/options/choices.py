"""What menus offer: the values of options that are chosen from a few."""

from __future__ import annotations

from .methods import METHODS
from .option_record import Choice

SCOPES = (
    Choice("all", "All", "Every mesh that shows in renders"),
    Choice("selected", "Selected", "The selected meshes that show in renders"),
    Choice(
        "changed",
        "Changed",
        "Objects whose shape, place or reflectance differs from the last bake; others keep their lightmaps, "
        "without new shadows. All, if the light has changed",
    ),
)

SIZE_MODES = (
    Choice("resolution", "Resolution", "Square images of this many pixels"),
    Choice("density", "Density", "Pixels per meter of surface; the image size follows"),
)

LOOKS = (
    Choice(
        "shine",
        "Shine",
        "Base color × lightmap, with the material's own highlights and reflections: specular, metal, coat, "
        "sheen and normal map. Lamps add highlights, but no more diffuse light",
    ),
    Choice("matte", "Matte", "Base color × lightmap alone, also for metals; no lamp changes it"),
    Choice("lightmap", "Lightmap", "The lightmap alone, as on white surfaces"),
)

ATLASES = (
    Choice("shared", "Shared", "One image for all objects"),
    Choice("per-object", "Per Object", "An image for each object"),
)

PACKS = (
    Choice("charts", "Charts", "All charts of a page together: the most texels for the surface"),
    Choice(
        "rectangles",
        "Rectangles",
        "Each object in a rectangle of its own: instances have the same UVs but for their offset, so that "
        "exports hold their mesh once",
    ),
)

QUALITIES = (
    Choice("sketch", "Sketch", "Fastest: few rays and coarse elements, to place lamps", number=4),
    Choice("draft", "Draft", "Fast: coarse elements and few rays, to judge the light"),
    Choice("medium", "Medium", "Clean light at a moderate time"),
    Choice("high", "High", "Fine elements and many rays, for the final bake"),
)

QUANTITIES = (
    Choice(
        "irradiance_over_pi",
        "Irradiance / π",
        "What Cycles' diffuse bake without color writes: the radiance of a white surface [W/m²/sr]",
    ),
    Choice("irradiance", "Irradiance", "The light that arrives [W/m²], as three.js adds it"),
    Choice(
        "radiosity",
        "Radiosity",
        "The light that leaves: emission and reflected light [W/m²]",
    ),
    Choice(
        "residual",
        "Residual",
        "The error picture: by how much the solution misses the radiosity equation, signed [W/m²]",
    ),
)

LIGHTS = (
    Choice("all", "All", "Direct and indirect light"),
    Choice("direct", "Direct", "Only light straight from lamps, emitters and the world"),
    Choice("indirect", "Indirect", "Only reflected light, for lamps that stay dynamic"),
)

FORMATS = (
    Choice("exr", "OpenEXR", "Linear floating point, exact"),
    Choice("png16", "PNG 16 bit", "Scaled to the brightest texel; the scale is in the report"),
)

ASSEMBLIES = (
    Choice("galerkin", "Galerkin", "Area means over elements: keeps the exchange of light reciprocal"),
    Choice("collocation", "Collocation", "Values at the centroids of elements"),
    Choice("linear", "Linear", "Values at vertices, linear between them"),
)

EXPORT_FORMS = (
    Choice(
        "web",
        "Web",
        "scene.glb and its lightmap, a loader for three.js, and viewer.html, which opens as it is",
    ),
    Choice("glb", "glTF", "scene.glb and its lightmap, and scene_baked.glb, which any viewer shows lit"),
    Choice("godot", "Godot", "scene.glb, OpenEXR lightmaps and an importer script for Godot 4"),
    Choice("unity", "Unity", "scene.glb, OpenEXR lightmaps and scripts for Unity"),
    Choice("bevy", "Bevy", "scene.glb, lightmaps and a module for Bevy"),
    Choice("rgbm", "RGBM", "scene.glb, and lightmaps also as PNG images for engines that read no HDR images"),
)

METHOD_CHOICES = tuple(Choice(name, method.label, method.description) for name, method in METHODS.items())
