"""The light that the lightmaps on the objects hold, read back from their pixels: after a reload as well."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np

from ...bake.result import MEANS
from ...lightmap.images import LightStatistics, light_statistics, lit_texels
from ...lightmap.texels import NO_TEXEL_HERE, rasterize, texel_areas
from ...numerics import Array, irradiance_under_sky, luminous, triangle_areas
from ...scene import LIGHTMAP_UV_LAYER
from ..datablocks.bake_record import is_made
from ..datablocks.image_marks import QUANTITY_PROPERTY
from ..datablocks.image_values import pixels_of
from ..datablocks.mesh_arrays import read_mesh, world_from_object
from ..images.images import image_scale
from ..session import kept_details
from ..session.state import session


@dataclass(frozen=True, eq=False)
class ShownLightmap:
    """An object that has a lightmap layer, as the viewport shows it.

    image: Name of its lightmap; None before a bake.
    corners (t, 3, 3) float32: World space, counter-clockwise from the front.
    uv (t, 3, 2) float32.
    """

    name: str
    image: str | None
    corners: Array
    uv: Array

    @property
    def areas(self) -> Array:
        """(t,) float64 [m²]"""
        return triangle_areas(self.corners.astype(np.float64))


@dataclass(frozen=True, eq=False)
class PageValues:
    """A lightmap's pixels.

    quantity: See `BakeSettings`.
    values (height, width, 3) float32 [W/m²]: Irradiance, or radiosity or residual if it holds these.
    """

    quantity: str
    values: Array

    def measured(self, unit: str, efficacy: float) -> Array:
        """Return (height, width) the values in "lux" or "watt"s; see `unit_name`."""
        if unit == "LUX" and self.quantity != "residual":
            return luminous(self.values, efficacy)
        return np.asarray(self.values @ MEANS)


def lightmap_of(obj: bpy.types.Object) -> bpy.types.Image | None:
    """Return the lightmap that a baked object's materials show; None if it has none."""
    for slot in obj.material_slots:
        material = slot.material
        if material is None or not is_made(material) or material.node_tree is None:
            continue
        for node in material.node_tree.nodes:
            image = node.image if node.type == "TEX_IMAGE" else None
            if image is not None and is_made(image) and QUANTITY_PROPERTY in image.keys():  # noqa: SIM118
                return image
    return None


def shown_lightmaps(context: bpy.types.Context) -> Iterator[ShownLightmap]:
    """Yield the visible objects whose meshes have a lightmap layer."""
    for obj in visible_with_layer(context):
        shown = shown_lightmap(obj)
        if shown is not None:
            yield shown


def visible_with_layer(context: bpy.types.Context) -> Iterator[bpy.types.Object]:
    """Yield the same as Blender's objects, whether there is anything on them or not."""
    for obj in context.view_layer.objects:
        if obj.type == "MESH" and LIGHTMAP_UV_LAYER in obj.data.uv_layers and obj.visible_get():
            yield obj


def shown_lightmap(obj: bpy.types.Object) -> ShownLightmap | None:
    """Return one object's lightmap layer; None without."""
    mesh = read_mesh(obj.data) if obj.type == "MESH" else None
    if mesh is None or mesh.lightmap_uv is None or len(mesh) == 0:
        return None
    corners, _, mirrored = world_from_object(mesh, np.array(obj.matrix_world, dtype=np.float64))
    uv = mesh.lightmap_uv[:, ::-1] if mirrored else mesh.lightmap_uv
    image = lightmap_of(obj)
    return ShownLightmap(
        obj.name, None if image is None else image.name, corners.astype(np.float32), np.ascontiguousarray(uv)
    )


def page_values(image: bpy.types.Image) -> PageValues | None:
    """Return a lightmap's pixels; None if its file is gone."""
    if image.name not in session.drawn.pages:
        pixels = pixels_of(image)
        if pixels is None:
            return None
        values = pixels[..., :3]
        quantity = str(image.get(QUANTITY_PROPERTY, "irradiance_over_pi"))
        factor = image_scale(image)
        if quantity == "irradiance_over_pi":
            factor = irradiance_under_sky(factor)
        session.drawn.pages[image.name] = PageValues(quantity, np.float32(factor) * values)
    return session.drawn.pages[image.name]


def unit_name(quantity: str, unit: str) -> str:
    """Return the unit of what `measured` gives: of light that leaves a surface it is not called lux."""
    if unit != "LUX" or quantity == "residual":
        return "W/m²"
    return "lm/m²" if quantity == "radiosity" else "lx"


def object_statistics(
    obj: bpy.types.Object, scene: bpy.types.Scene, unit: str, efficacy: float
) -> tuple[LightStatistics, str] | None:
    """Sum up the light on an object's front, from its lightmap; None if it has none.

    Texels that geometry divides or shuts in are left out while the bake is in memory, those without any light
    after it has been reloaded.
    """
    image = lightmap_of(obj)
    page = None if image is None else page_values(image)
    if image is None or page is None:
        return None
    key = obj.name_full, image.name
    if key not in session.drawn.statistics:
        session.drawn.statistics[key] = _summed_up(obj, scene, image, page)
    found = session.drawn.statistics[key]
    if found is None:
        return None
    of_watts, of_lumens = found
    name = unit_name(page.quantity, unit)
    if name == "W/m²":
        return of_watts, name
    return LightStatistics(
        *(efficacy * getattr(of_lumens, part) for part in ("minimum", "mean", "maximum"))
    ), name


def _summed_up(
    obj: bpy.types.Object, scene: bpy.types.Scene, image: bpy.types.Image, page: PageValues
) -> tuple[LightStatistics, LightStatistics] | None:
    """Return statistics in W/m² and, at one lumen a watt, in lux."""
    shown = shown_lightmap(obj)
    if shown is None:
        return None
    height = len(page.values)
    texels = rasterize(shown.uv, height, surface=shown.areas)
    values = page.values[texels.row, texels.column].astype(np.float64)
    areas = texel_areas(shown.uv, shown.areas, height)[texels.triangle] * texels.area
    kept = kept_details.details_of(scene)
    details = None if kept is None else kept.page_of(image.name)
    if details is not None:
        state = details.state[texels.row, texels.column]
        has_value = lit_texels(np.where(state == NO_TEXEL_HERE, 0, state))
    else:
        has_value = values.any(axis=1) if values.any() else np.ones(len(values), dtype=bool)
    of_watts = light_statistics(values[has_value] @ MEANS, areas[has_value])
    of_lumens = light_statistics(luminous(values[has_value], 1.0), areas[has_value])
    return None if of_watts is None or of_lumens is None else (of_watts, of_lumens)
