"""What each overlay shows, as arrays: surfaces with painted pages, lines, a legend. Nothing is drawn here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...lightmap.texels import DIVIDED, ENCLOSED, NO_TEXEL_HERE, OCCLUDED, TOUCHED, texel_areas
from ...numerics import Array
from ...solver.state import leaves_on, nearest_leaf
from ..session.kept_details import STAND_IN_SUFFIX, KeptDetails, details_of
from . import overlay_properties as kinds
from .color_scale import ColorScale, automatic_scale
from .lightmap_values import (
    ShownLightmap,
    lightmap_of,
    page_values,
    shown_lightmaps,
    unit_name,
    visible_with_layer,
)
from .overlay_properties import overlay_of

STATE_COLORS = {
    DIVIDED: ((0.90, 0.25, 0.15), "Divided: geometry crosses them"),
    OCCLUDED: ((0.95, 0.60, 0.10), "Occluded: geometry is close above"),
    TOUCHED: ((0.95, 0.90, 0.30), "Touched: geometry is at their edge"),
    ENCLOSED: ((0.55, 0.25, 0.75), "Enclosed: no light reaches them"),
}
"""Display colors of the states of texels, and what they are."""

MAX_PICTURE_WIDTH = 2048
"""Pages of more pixels are drawn coarser: as colors they would take a quarter of a gigabyte at 4096."""

CHECKERS = ((0.25, 0.25, 0.27), (0.85, 0.85, 0.82))
EDGE_COLOR = (0.05, 0.05, 0.05, 1.0)
CHOSEN = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True)
class PagedTriangles:
    """Triangles that show pages.

    Attributes
    ----------
    corners : (t, 3, 3) float32
    uv : (t, 3, 2) float32
    page : (t,) int
    pages : sequence of (height, width, 4) float32
        Display colors; without alpha nothing is drawn.
    """

    corners: Array
    uv: Array
    page: Array
    pages: Sequence[Array]


@dataclass(frozen=True)
class Lines:
    """Straight lines.

    Attributes
    ----------
    ends : (l, 2, 3) float32
    colors : (l, 4) float32
    width : float
        In pixels.
    through : bool
        Whether they are seen through what is in front of them.
    """

    ends: Array
    colors: Array
    width: float = 1.0
    through: bool = False


@dataclass(frozen=True)
class Legend:
    """What the colors mean.

    Attributes
    ----------
    title : str
    unit : str
    scale : ColorScale or None
    entries : tuple of (color, text)
        In place of a scale.
    """

    title: str
    unit: str = ""
    scale: ColorScale | None = None
    entries: tuple[tuple[tuple[float, float, float], str], ...] = ()


@dataclass(frozen=True)
class OverlayPicture:
    """One overlay, ready to be drawn."""

    surfaces: PagedTriangles | None = None
    lines: tuple[Lines, ...] = ()
    legend: Legend | None = None


def overlay_picture(context: bpy.types.Context) -> OverlayPicture | None:
    """Make the overlay that is chosen; None if there is nothing to show, for `missing` says why."""
    settings = overlay_of(context)
    if settings.show == kinds.NONE:
        return None
    if settings.show in kinds.OF_THE_BAKE:
        kept = details_of(context.scene)
        if kept is None:
            return None
        if settings.show == kinds.ELEMENTS:
            return _elements(kept)
        if settings.show == kinds.LINKS:
            return _links(context, kept)
        return _texels(context, kept)
    shown = [found for found in shown_lightmaps(context) if settings.show != kinds.FALSE_COLOR or found.image]
    if not shown:
        return None
    if settings.show == kinds.FALSE_COLOR:
        return _false_colors(context, shown)
    return _density(context, shown)


def missing(context: bpy.types.Context) -> str:
    """Say why the chosen overlay cannot be shown; empty if it can."""
    settings = overlay_of(context)
    if settings.show == kinds.NONE:
        return ""
    if settings.show in kinds.OF_THE_BAKE:
        kept = details_of(context.scene)
        if kept is None:
            return "Bake first: this is kept in memory only, not in the file"
        if settings.show in (kinds.TEXELS, kinds.ERROR) and not kept.details.pages:
            return "A baked residual has no texels of light; bake another quantity"
        return ""
    if settings.show == kinds.FALSE_COLOR:
        shown = any(lightmap_of(obj) is not None for obj in visible_with_layer(context))
        return "" if shown else "No visible object shows a lightmap; bake first"
    laid_out = any(True for _ in visible_with_layer(context))
    return "" if laid_out else "No visible object has a UV layer 'Lightmap'; bake first"


def lightmap_width(context: bpy.types.Context, image: str | None) -> int:
    """Return how wide a lightmap is; before a bake, how wide it is going to be [pixels]."""
    found = None if image is None else bpy.data.images.get(image)
    return context.scene.radiosity.resolution if found is None else int(found.size[0])


def _false_colors(context: bpy.types.Context, shown: list[ShownLightmap]) -> OverlayPicture | None:
    settings = overlay_of(context)
    names = list(dict.fromkeys(found.image for found in shown))
    read = {name: page_values(bpy.data.images[name]) for name in names if name is not None}
    pages = {name: page for name, page in read.items() if page is not None}
    shown = [found for found in shown if found.image in pages]
    if not shown:
        return None
    measured = {name: page.measured(settings.unit, settings.efficacy) for name, page in pages.items()}
    quantity = next(iter(pages.values())).quantity
    # Pixels that show no surface are filled from those that do, or 0 farther off.
    values = np.concatenate([page[page != 0.0] for page in measured.values()])
    scale = _scale(context, values, quantity == "residual")
    painted = {name: _opaque(scale(coarse_page(page))) for name, page in measured.items()}
    titles = {"residual": "Residual", "radiosity": "Radiosity"}
    title = titles.get(quantity, "Illuminance" if settings.unit == "LUX" else "Irradiance")
    legend = Legend(title, unit_name(quantity, settings.unit), scale)
    return OverlayPicture(_surfaces(shown, painted), legend=legend)


def _density(context: bpy.types.Context, shown: list[ShownLightmap]) -> OverlayPicture:
    """Show how dense texels are as a color of each triangle, or the texels themselves."""
    settings = overlay_of(context)
    sizes = [lightmap_width(context, found.image) for found in shown]
    if settings.show == kinds.CHECKER:
        pages = {str(size): _checker(size, settings.squares) for size in set(sizes)}
        named = [replace(found, image=str(size)) for found, size in zip(shown, sizes, strict=True)]
        return OverlayPicture(_surfaces(named, pages))
    density = np.concatenate(
        [texels_per_meter(found, size) for found, size in zip(shown, sizes, strict=True)]
    )
    # What most has gets the middle color: blue is coarser, red finer.
    order = np.argsort(density)
    surface = np.cumsum(np.concatenate([found.areas for found in shown])[order])
    usual = float(density[order[np.searchsorted(surface, 0.5 * surface[-1])]])
    scale = (
        ColorScale(0.0, 2.0 * usual) if settings.automatic and usual > 0 else _scale(context, density, False)
    )
    # A page of one texel a triangle: each has one color.
    side = int(np.ceil(np.sqrt(len(density))))
    page = np.zeros((side**2, 4), dtype=np.float32)
    page[: len(density)] = _opaque(scale(density))
    row, column = np.divmod(np.arange(len(density)), side)
    spot = (np.stack([column, row], axis=1) + 0.5) / side
    corners = np.concatenate([found.corners for found in shown])
    uv = np.repeat(spot[:, None].astype(np.float32), 3, axis=1)
    surfaces = PagedTriangles(
        corners, uv, np.zeros(len(corners), dtype=np.int32), [page.reshape(side, side, 4)]
    )
    return OverlayPicture(surfaces, legend=Legend("Texel Density", "px/m", scale))


def texels_per_meter(found: ShownLightmap, size: int) -> Array:
    """Return (t,) lightmap pixels along one meter of each triangle: the root of how many are in 1 m²."""
    return np.asarray(1.0 / np.sqrt(np.maximum(texel_areas(found.uv, found.areas, size), 1e-30)))


def _texels(context: bpy.types.Context, kept: KeptDetails) -> OverlayPicture | None:
    """Show what is known of texels: what they are, or how far off."""
    settings = overlay_of(context)
    shown = [found for found in shown_lightmaps(context) if found.image and kept.page_of(found.image)]
    pages = dict(zip(kept.images, kept.details.pages, strict=False))
    if not shown or not pages:
        return None
    if settings.show == kinds.TEXELS:
        table = np.zeros((256, 4), dtype=np.float32)
        for state, (color, _) in STATE_COLORS.items():
            table[state] = (*color, 1.0)
        painted = {name: table[coarse_page(page.state)] for name, page in pages.items()}
        entries = tuple(STATE_COLORS.values())
        return OverlayPicture(_surfaces(shown, painted), legend=Legend("Problem Texels", entries=entries))
    signed = settings.error_of == "ELEMENTS"
    errors = {
        name: page.unit * (page.misfit if signed else page.noise).astype(np.float32)
        for name, page in pages.items()
    }
    known = np.concatenate([errors[name][page.state != NO_TEXEL_HERE] for name, page in pages.items()])
    scale = _scale(context, known, signed)
    painted = {name: _opaque(scale(coarse_page(values))) for name, values in errors.items()}
    title = "Elements Minus Texels" if signed else "Estimated Noise"
    return OverlayPicture(_surfaces(shown, painted), legend=Legend(title, "W/m²", scale))


def _elements(kept: KeptDetails) -> OverlayPicture:
    record, seen = kept.details.links, kept.seen()
    leaves = np.flatnonzero(record.leaf & record.front)
    corners = record.corners[leaves[seen[record.triangle[leaves]]]]
    return OverlayPicture(lines=(_edges(corners, EDGE_COLOR),))


def _links(context: bpy.types.Context, kept: KeptDetails) -> OverlayPicture | None:
    settings, record = overlay_of(context), kept.details.links
    chosen = chosen_elements(context, kept)
    if len(chosen) == 0:
        return None
    start, end, arriving = record.reaching(chosen)
    strongest = np.argsort(arriving, kind="stable")[-settings.most_links :]
    strongest = strongest[arriving[strongest] > 0]
    values = arriving[strongest]
    scale = _scale(context, values, False)
    colors = np.ones((len(values), 4), dtype=np.float32)
    colors[:, :3] = scale(values)
    ends = np.stack([start[strongest], end[strongest]], axis=1)
    lines = _edges(record.corners[chosen], CHOSEN, 2.0), Lines(ends, colors, 1.5, through=True)
    return OverlayPicture(lines=lines, legend=Legend("Light by Links", "W/m²", scale))


def chosen_elements(context: bpy.types.Context, kept: KeptDetails) -> Array:
    """Return the leaf elements whose links are to be shown; none if the active face was not baked."""
    record = kept.details.links
    if overlay_of(context).links_of == "CURSOR":
        nearest = nearest_leaf(record, np.array(context.scene.cursor.location, dtype=np.float64))
        return np.array([] if nearest is None else [nearest], dtype=np.int64)
    obj = context.active_object
    item = None if obj is None else kept.objects.get(obj.name.removesuffix(STAND_IN_SUFFIX))
    if item is None or obj.type != "MESH" or len(obj.data.polygons) == 0:
        return np.zeros(0, dtype=np.int64)
    triangles = np.flatnonzero(item.polygon == obj.data.polygons.active) + item.first
    return leaves_on(record, triangles)


def _scale(context: bpy.types.Context, values: Array, signed: bool) -> ColorScale:
    """Return the scale by hand, or one for the values."""
    settings = overlay_of(context)
    if settings.automatic or settings.high <= settings.low:
        return automatic_scale(values, signed)
    return ColorScale(settings.low, settings.high, signed)


def _surfaces(shown: Sequence[ShownLightmap], pages: dict[str, Array]) -> PagedTriangles:
    """Return objects with the pages that are theirs by name."""
    number = {name: row for row, name in enumerate(pages)}
    page = [np.full(len(found.corners), number[str(found.image)], dtype=np.int32) for found in shown]
    return PagedTriangles(
        np.concatenate([found.corners for found in shown]),
        np.concatenate([found.uv for found in shown]),
        np.concatenate(page),
        list(pages.values()),
    )


def coarse_page(page: Array) -> Array:
    """Return a page of at most `MAX_PICTURE_WIDTH` pixels: of more it leaves some out."""
    if len(page) <= MAX_PICTURE_WIDTH:
        return page
    kept = ((np.arange(MAX_PICTURE_WIDTH) + 0.5) * len(page) / MAX_PICTURE_WIDTH).astype(np.int64)
    return np.asarray(page[np.ix_(kept, kept)])


def _checker(size: int, squares: int) -> Array:
    """Return (size, size, 4) of squares that are light and dark in turn."""
    row, column = np.divmod(np.arange(size**2), size)
    dark = ((row // squares + column // squares) % 2).astype(np.int64)
    return _opaque(np.array(CHECKERS, dtype=np.float32)[dark]).reshape(size, size, 4)


def _opaque(colors: Array) -> Array:
    """Return (…, 4) for (…, 3) colors."""
    return np.concatenate([colors, np.ones((*colors.shape[:-1], 1), dtype=np.float32)], axis=-1)


def _edges(corners: Array, color: tuple[float, ...], width: float = 1.0) -> Lines:
    """Return the edges of (n, 3, 3) triangles."""
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    return Lines(ends, np.broadcast_to(np.array(color, dtype=np.float32), (len(ends), 4)), width)
