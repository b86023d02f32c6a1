"""Assembly of the linear system: Galerkin or collocation, constant or linear elements (handout §3.2, §3.3).

| assembly | K_ij | source |
|---|---|---|
| `galerkin` | area-averaged form factors between constant elements, one for each pair | (3.19), (3.27) |
| `collocation` | from the centroid of i to the whole of constant element j | (3.13) |
| `linear` | from vertex i to the hat of vertex j | (3.9)–(3.13) |

All return the same `LinearSystem`, of the surfaces' own emission; `with_lamps` adds the lamps'
light.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...form_factors import point_to_polygon
from ...numerics import Array, map_chunks
from ...rays import RayCaster
from ...scene import Faces, arriving, shares
from ..hierarchy import Basis, Hierarchy, constant_basis
from .exchange import exchange_areas
from .linear_basis import vertex_basis
from .linear_system import LinearSystem
from .point_exchange import corner_factors, visible_share

BLOCK_PAIRS = 1 << 18
"""Pairs between two reports of progress, about half a second's work; their numbers take 4 MB."""

CHUNK_PAIRS = 1 << 16
"""Pairs of a point and an element that one thread processes together; about 60 MB."""

FACING = 1e-13
"""A face rises over another's plane if by more than this part of the scene's extent."""


def galerkin(
    hierarchy: Hierarchy,
    caster: RayCaster,
    basis: Basis | None = None,
    seed: int = 0,
    threads: int = 0,
    progress: Progress = SILENT,
) -> LinearSystem:
    """Assemble K_ij = δ_ij − ρ_i F_ij with area-averaged F, of constant elements on the leaves (3.26).

    Reciprocal: T_ij = A_i F_ij V_ij is computed once for each pair.

    basis: From `constant_basis`, which None calls.
    """
    basis = basis or constant_basis(hierarchy)
    count = len(basis)
    exchange = np.zeros((count, count))
    leaf, of_face = basis.leaf, basis.faces(hierarchy)
    for rows in _blocks(count):
        first = np.arange(rows.start, rows.stop)
        seen = _facing(hierarchy.faces, of_face[rows], of_face)
        seen &= np.arange(count)[None] > first[:, None]
        one, other = np.nonzero(seen)
        one += rows.start
        values = exchange_areas(hierarchy, caster, leaf[one], leaf[other], seed, threads)
        exchange[one, other] = values
        exchange[other, one] = values
        # The rows shorten: what is done grows as the area of the trapezoid above.
        progress.at(1.0 - (1.0 - rows.stop / count) ** 2)
    return _system(hierarchy, basis, exchange, reciprocal=True)


def collocation(
    hierarchy: Hierarchy,
    caster: RayCaster,
    basis: Basis | None = None,
    seed: int = 0,
    threads: int = 0,
    progress: Progress = SILENT,
) -> LinearSystem:
    """Assemble K_ij = δ_ij − ρ_i F(x_i, j) V with x_i the centroids of constant elements (3.13)."""
    basis = basis or constant_basis(hierarchy)
    exchange, area = np.zeros((len(basis), len(basis))), basis.area

    def put(point: Array, leaf_row: Array, values: Array) -> None:
        exchange[point, leaf_row] = area[point] * values

    _measure_points(hierarchy, caster, basis, _centroid_factors, put, seed, threads, progress)
    return _system(hierarchy, basis, exchange)


def linear(
    hierarchy: Hierarchy,
    caster: RayCaster,
    basis: Basis | None = None,
    seed: int = 0,
    threads: int = 0,
    progress: Progress = SILENT,
) -> LinearSystem:
    """Assemble K_ij = N_j(x_i) − ρ_i ∫ N_j κ V dA with hats N_j at the leaves' vertices (3.9).

    basis: From `vertex_basis`, which None calls; needed again to evaluate the solution.
    """
    basis = basis or vertex_basis(hierarchy)
    exchange, area, corner = np.zeros((len(basis), len(basis))), basis.area, basis.corner

    def put(point: Array, leaf_row: Array, values: Array) -> None:
        for place in range(3):
            np.add.at(exchange, (point, corner[leaf_row, place]), area[point] * values[:, place])

    _measure_points(hierarchy, caster, basis, corner_factors, put, seed, threads, progress)
    return _system(hierarchy, basis, exchange)


def with_lamps(system: LinearSystem, direct: Array) -> LinearSystem:
    """Return the system with E + ρ H_lamps for emission, given (n, 3) irradiance from lamps [W/m²]."""
    return replace(system, emission=system.emission + system.reflectance * direct)


def share_overlaps(system: LinearSystem, opacity: Array) -> tuple[LinearSystem, Array]:
    """Keep elements from exchanging more than there is (see `overlaps`).

    Of a reciprocal system every element *sends* only its share s, as in shooting: in C = s B
    that is the same system with s ρ for ρ and s E for E, so T stays as it is, and symmetric.
    Of others every row, what an element *receives*, is scaled in place.

    opacity (n,): Of each unknown's surface: what is not there takes no light.
    Returns system: Of the unknowns C.
    Returns sends (n,): s: B = C / s. 1 throughout where the rows were scaled, and where nothing overlaps.
    """
    share = shares(arriving(system.exchange, opacity) / system.area)
    if system.reciprocal:
        scale = share[:, None]
        return replace(
            system, reflectance=scale * system.reflectance, emission=scale * system.emission
        ), share
    for rows in _blocks(len(system)):
        system.exchange[rows] *= share[rows, None]
    return system, np.ones(len(system))


def _measure_points(
    hierarchy: Hierarchy,
    caster: RayCaster,
    basis: Basis,
    measure: Callable[[Array, Array, Array, Array], Array],
    put: Callable[[Array, Array, Array], None],
    seed: int,
    threads: int,
    progress: Progress,
) -> None:
    """Measure all pairs of a node and a leaf, and hand them to `put`."""
    step = max(CHUNK_PAIRS // max(len(basis.leaf), 1), 1)
    points, faces = basis.points(hierarchy), basis.faces(hierarchy)
    for block in _blocks(len(basis), len(basis.leaf)):
        of_block = points[block], faces[block]
        work = partial(_pairs, hierarchy, caster, basis.leaf, *of_block, measure, seed, block.start)
        for _, found in map_chunks(work, block.stop - block.start, step, threads):
            if found is not None:
                put(*found)
        progress.at(block.stop / len(basis))


def _pairs(
    hierarchy: Hierarchy,
    caster: RayCaster,
    leaf: Array,
    points: Array,
    faces: Array,
    measure: Callable[[Array, Array, Array, Array], Array],
    seed: int,
    first: int,
    rows: slice,
) -> tuple[Array, Array, Array] | None:
    """Return points on faces, numbered from `first`, leaves, and what they exchange, pair by pair, if any."""
    point, row = np.nonzero(_facing(hierarchy.faces, faces[rows], hierarchy.face[leaf]))
    if len(point) == 0:
        return None
    point += rows.start
    facing = hierarchy.faces.normal[faces[point]]
    corners, leaf_normals = hierarchy.corners[leaf[row]], hierarchy.normal[leaf[row]]
    factors = measure(points[point], facing, corners, leaf_normals)
    lit = np.flatnonzero(factors.reshape(len(point), -1).max(axis=1, initial=0.0) > 0)
    point, row, factors = point[lit], row[lit], factors[lit]
    number = first + point
    pair = number.astype(np.int64) << 32 | row
    share = visible_share(caster, points[point], facing[lit], corners[lit], leaf_normals[lit], pair, seed)
    return number, row, (factors.T * share).T


def _system(hierarchy: Hierarchy, basis: Basis, exchange: Array, reciprocal: bool = False) -> LinearSystem:
    element = basis.elements()
    return LinearSystem(
        exchange=exchange,
        reflectance=hierarchy.reflectance[element],
        emission=hierarchy.emission[element],
        area=basis.area,
        mass=basis.mass(),
        reciprocal=reciprocal,
    )


def _centroid_factors(points: Array, normals: Array, corners: Array, _: Array) -> Array:
    return point_to_polygon(points, normals, corners)


def _facing(faces: Faces, one: Array, other: Array) -> Array:
    """Return (m, n) whether parts of face `one` (m,) and face `other` (n,) may look at each other."""
    rows, row = np.unique(one, return_inverse=True)
    columns, column = np.unique(other, return_inverse=True)
    extent = np.abs(faces.corners).max(initial=0.0)
    over = _rise(faces, rows, columns) > FACING * extent
    over &= FACING * extent < _rise(faces, columns, rows).T
    return np.asarray(over[row.reshape(-1)[:, None], column.reshape(-1)])


def _rise(faces: Faces, base: Array, of: Array) -> Array:
    """Return (b, o) the height of the highest corner of faces `of` over the planes of faces `base`."""
    normal = faces.normal[base]
    ground = np.einsum("bk,bk->b", normal, faces.corners[base, 0])
    height = normal @ faces.corners[of].reshape(-1, 3).T
    return np.asarray(height.reshape(len(base), -1, 3).max(axis=2) - ground[:, None])


def _blocks(count: int, columns: int | None = None) -> list[slice]:
    """Return slices of rows of at most `BLOCK_PAIRS` pairs that cover 0 … count."""
    step = max(BLOCK_PAIRS // max(columns or count, 1), 1)
    return [slice(start, min(start + step, count)) for start in range(0, count, step)]
