"""Materials that vary over a surface: reflectance, emission and opacity as one image.

All triangles with such materials have tiles in one image, into which Cycles evaluates them:
one bake for each of the three, however many objects there are.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from functools import partial

import bpy
import numpy as np

from ...base import elsewhere
from ...lightmap.images import SurfaceTiles, lay_out_surfaces
from ...numerics import MAX_REFLECTANCE, radiance_of_radiosity, radiosity_of_radiance, triangle_areas
from ...options import BakeSettings
from ...scene import SurfaceImages
from ..datablocks.mesh_arrays import normal_matrix, world_from_object
from ..materials.materials import Surface
from ..materials.surface_terms import passing_color, surface_of_terms
from ..scene_records.export_sources import MaterialSource
from ..scene_records.pieces import Piece
from .surface_bake import SurfaceBake
from .surface_batches import Batch, batches, material_facts
from .surface_rewiring import EXPRESSIONS

MIN_SIDE, MIN_CUT_OUT_SIDE, MAX_SIDE = 256, 1024, 2048
"""Texels along the image's side."""

TEXEL_BYTES, CUT_OUT_BYTES = 28.0, 72.0
"""What is kept of each: reflectance, emission and opacity; where some are cut out, also these multiplied by
opacity, and the colors that pass."""


def evaluate_surfaces(
    context: bpy.types.Context,
    pieces: Sequence[Piece],
    surfaces: Sequence[Surface],
    materials: Sequence[MaterialSource | None],
    settings: BakeSettings,
    in_background: bool = False,
) -> Generator[float, None, SurfaceImages | None]:
    """Evaluate the materials that vary, on all pieces at once.

    Each bake of Cycles is a step, which leaves nothing in the file: it may be edited before the next.

    pieces: All of the scene, in its order.
    materials: Parallel to `surfaces`: the file's own, not evaluated ones.
    settings: `resolution` and `threads` matter here.
    in_background: Whether a window waits.
    Returns none where constants suffice.
    Raises BakeError if Cycles did not bake.
    Raises SceneError if a material is gone.
    """
    surface = np.concatenate([piece.surface for piece in pieces])
    plain = np.array([one.is_plain for one in surfaces])
    rows = np.flatnonzero(~plain[surface])
    if not len(rows):
        return None
    corners, inputs = yield from elsewhere(lambda: _gather(pieces, rows), in_background)
    own = surface[rows]
    varies = np.array([one.varies for one in surfaces])[own]
    needed = {row: materials[row] for row in sorted(set(own[varies].tolist()))}
    yield 0.0
    facts = yield from material_facts(needed, tuple(inputs))
    cut_out = [
        one.opacity < 1.0 or (row in facts and "passed" in facts[row].varying)
        for row, one in enumerate(surfaces)
    ]
    # Where no material varies in a channel, the constants apply.
    varying = [channel for channel in EXPRESSIONS if any(channel in each.varying for each in facts.values())]
    yield 0.1

    def laid_out() -> tuple[SurfaceTiles, dict[str, np.ndarray], list[Batch]]:
        area = np.where(varies, triangle_areas(corners), 0.0)
        tiles = lay_out_surfaces(area, np.array(cut_out)[own].astype(int), _side(settings, any(cut_out)))
        divided = batches(tiles, corners, inputs, own, facts) if varying else []
        return tiles, _terms_of_constants(tiles, surfaces, own), divided

    tiles, terms, divided = yield from elsewhere(laid_out, in_background)
    for number, batch in enumerate(divided):
        materials_here = {row: needed[row] for row in np.unique(batch.drawn.surface).tolist()}
        for channel in varying:
            yield 0.2 + 0.7 * number / len(divided)
            with closing(SurfaceBake(context, settings, materials_here, tuple(inputs))) as bake:
                bake.draw(batch.drawn)
                seen = bake.channel(channel)
            yield from elsewhere(partial(batch.put, seen, terms[channel]), in_background)
    glass = np.array([one.glass for one in surfaces])[own]
    return (yield from elsewhere(lambda: _images(tiles, terms, rows, glass, len(surface)), in_background))


def foreseen_bytes(surfaces: Sequence[Surface], settings: BakeSettings) -> float:
    """Return about what the image of the materials that vary will take [bytes]."""
    if not any(one.varies for one in surfaces):
        return 0.0
    cut_out = any(one.opacity < 1.0 for one in surfaces)
    return (CUT_OUT_BYTES if cut_out else TEXEL_BYTES) * _side(settings, cut_out) ** 2


def _side(settings: BakeSettings, cut_out: bool) -> int:
    """Return twice the lightmap's own texels, where those are known, within bounds.

    Four times where light falls through holes: their shadows are as sharp as their edges.
    """
    if settings.texel_density is not None or settings.atlas != "shared":
        return MAX_SIDE
    wanted = (4 if cut_out else 2) * settings.resolution
    return min(max(wanted, MIN_CUT_OUT_SIDE if cut_out else MIN_SIDE), MAX_SIDE)


def _gather(pieces: Sequence[Piece], rows: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return world corners (n, 3, 3) of triangles, and inputs of the nodes there, (n, 3, 4) by name."""
    names = sorted({name for piece in pieces for name in piece.asked})
    corners = np.empty((len(rows), 3, 3))
    inputs = {name: np.zeros((len(rows), 3, 4), dtype=np.float32) for name in names}
    first = 0
    for piece in pieces:
        inside = slice(*np.searchsorted(rows, [first, first + len(piece.mesh)]))
        own = rows[inside] - first
        first += len(piece.mesh)
        if not len(own):
            continue
        world, _, mirrored = world_from_object(piece.mesh, piece.matrix)
        order = slice(None, None, -1 if mirrored else 1)
        corners[inside] = world[own]
        for name, values in piece.inputs.items():
            inputs[name][inside] = values if values.ndim == 1 else values[own][:, order]
        computed = {
            "object": piece.mesh.corners[:, order],
            "normal": piece.mesh.normals[:, order],
            "world normal": (piece.mesh.normals @ normal_matrix(piece.matrix[:3, :3]).T)[:, order],
        }
        for name in computed.keys() & piece.asked:
            inputs[name][inside, :, :3] = computed[name][own]
    return corners, inputs


def _terms_of_constants(
    tiles: SurfaceTiles, surfaces: Sequence[Surface], surface: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the three channels (h, w, 3) with what is constant filled in."""
    shape = (tiles.height, tiles.width, 3)
    terms = {channel: np.zeros(shape, dtype=np.float32) for channel in EXPRESSIONS}
    opacity = np.array([one.opacity for one in surfaces])
    constants = {
        "reflected": np.array([one.reflectance for one in surfaces]) * opacity[:, None],
        "radiance": radiance_of_radiosity(np.array([one.emission for one in surfaces])) * opacity[:, None],
        "passed": np.array([_passed(one) for one in surfaces]),
    }
    triangle, row, column, *_ = tiles.texels()
    for channel, values in constants.items():
        terms[channel][row, column] = values[surface[triangle]]
    return terms


def _passed(surface: Surface) -> np.ndarray:
    """Return (3,) what passes a surface by channel."""
    return np.full(3, 1.0 - surface.opacity) if surface.passed is None else surface.passed


def _images(
    tiles: SurfaceTiles, terms: Mapping[str, np.ndarray], rows: np.ndarray, glass: np.ndarray, count: int
) -> SurfaceImages:
    """Put the terms together for `rows`, of which some are glass: light passes these by color."""
    reflectance, radiance, opacity = surface_of_terms(*(terms[channel] for channel in EXPRESSIONS))
    values = np.empty((tiles.height, tiles.width, 7), dtype=np.float32)
    values[..., :3] = np.clip(np.nan_to_num(reflectance), 0.0, MAX_REFLECTANCE)
    values[..., 3:6] = radiosity_of_radiance(np.maximum(np.nan_to_num(radiance, posinf=0.0), 0.0))
    values[..., 6] = opacity
    passes, of_glass = None, np.zeros(count, dtype=bool)
    of_glass[rows] = glass
    if glass.any():
        triangle, row, column, *_ = tiles.texels()
        row, column = row[glass[triangle]], column[glass[triangle]]
        passes = np.repeat(1.0 - values[..., 6:], 3, axis=2)
        passes[row, column] = passing_color(terms["passed"][row, column], opacity[row, column])
        tiles.fill_diagonals(passes)
    tiles.fill_diagonals(values)
    image_uv = np.zeros((count, 3, 2), dtype=np.float32)
    image_uv[rows] = tiles.coordinates()
    textured = np.zeros(count, dtype=bool)
    textured[rows] = True
    return SurfaceImages(values, image_uv, textured, passes, of_glass)
