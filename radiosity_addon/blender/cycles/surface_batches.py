"""The triangles whose materials vary, in batches that a step can evaluate.

A batch has an image of its own for the time of its bake, no larger than its triangles' tiles take: Cycles
draws each texel once, however many batches there are.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...lightmap.images import SurfaceTiles, lay_out_again
from ..datablocks.bake_record import remove_datablocks
from ..scene_records.export_sources import MaterialSource
from .surface_bake import DrawnSurfaces, attribute_names, drawn_surfaces
from .surface_rewiring import EXPRESSIONS, RewiredMaterial

MOMENT = 0.04
"""Maximum seconds of rewiring materials per step, if one material takes less."""

MAX_NODES = 64
"""Maximum nodes of a batch's materials, if one material has fewer; making 64 takes about 20 ms."""

MAX_TEXELS = 1024 * 1024
"""Texels of a batch; Cycles takes 0.3–0.9 s for them."""

TEXELS_OF_MESH = 8
"""Cost of a triangle in a batch's mesh, in texels."""


@dataclass(frozen=True)
class MaterialFacts:
    """A material's rewired copy, after it is gone.

    varying frozenset of str: The channels in which it is not the same all over.
    nodes: Those of its trees.
    """

    varying: frozenset[str]
    nodes: int


@dataclass(frozen=True, eq=False)
class Batch:
    """A batch of n triangles.

    tiles: In the batch's own image.
    row, column (m,) int64: Where each of `tiles.texels()` is in the image of all.
    """

    tiles: SurfaceTiles
    drawn: DrawnSurfaces
    row: np.ndarray
    column: np.ndarray

    def put(self, seen: np.ndarray, into: np.ndarray) -> None:
        """Copy the texels of a batch's image (h, w, 3) into the image of all."""
        _, row, column, *_ = self.tiles.texels()
        into[self.row, self.column] = seen[row, column]


def material_facts(
    materials: Mapping[int, MaterialSource | None], inputs: Sequence[str]
) -> Generator[float, None, dict[int, MaterialFacts]]:
    """Rewire each material temporarily, several per step.

    materials mapping of int to MaterialSource or None: By their surface.
    inputs: Inputs of their nodes.
    """
    facts: dict[int, MaterialFacts] = {}
    until = time.perf_counter() + MOMENT
    for row, source in materials.items():
        if source is None:
            continue
        if time.perf_counter() > until:
            yield len(facts) / len(materials)
            until = time.perf_counter() + MOMENT
        rewired = RewiredMaterial(source.find(), attribute_names(inputs), source.lets_through, source.gloss)
        varying = frozenset(channel for channel in EXPRESSIONS if not rewired.is_constant(channel))
        facts[row] = MaterialFacts(varying, rewired.node_count)
        remove_datablocks(rewired.made)
    return facts


def batches(
    tiles: SurfaceTiles,
    corners: np.ndarray,
    inputs: Mapping[str, np.ndarray],
    surface: np.ndarray,
    facts: Mapping[int, MaterialFacts],
) -> list[Batch]:
    """Divide the triangles that vary; works on arrays alone.

    tiles: Of n triangles.
    corners (n, 3, 3).
    inputs mapping of str to (n, 3, 4) float32.
    surface (n,) int.
    facts mapping of int to MaterialFacts: Of those that vary.
    """
    triangle, row, column, *_ = tiles.texels()
    made = []
    for chosen in _divided(tiles, surface, facts):
        own = lay_out_again(tiles, chosen)
        of = {name: values[chosen] for name, values in inputs.items()}
        texels = np.isin(triangle, chosen)
        drawn = drawn_surfaces(own, corners[chosen], of, surface[chosen])
        made.append(Batch(own, drawn, row[texels], column[texels]))
    return made


def _divided(
    tiles: SurfaceTiles, surface: np.ndarray, facts: Mapping[int, MaterialFacts]
) -> list[np.ndarray]:
    """Return the triangles of each batch, ascending: one material after the other, until one is full."""
    leg = tiles.leg.astype(np.int64)
    size = leg * (leg + 1) // 2 + TEXELS_OF_MESH
    found: list[list[np.ndarray]] = []
    nodes = texels = 0
    for row in sorted(facts):
        of_material = np.flatnonzero(surface == row)
        while len(of_material):
            if not found or nodes + facts[row].nodes > MAX_NODES or texels >= MAX_TEXELS:
                found.append([])
                nodes = texels = 0
            total = np.cumsum(size[of_material])
            fits = max(int(np.searchsorted(total, MAX_TEXELS - texels, "right")), 1)
            found[-1].append(of_material[:fits])
            nodes, texels = nodes + facts[row].nodes, texels + int(total[min(fits, len(total)) - 1])
            of_material = of_material[fits:]
            if len(of_material):
                texels = MAX_TEXELS
    return [np.sort(np.concatenate(parts)) for parts in found]
