"""How well a solution solves the equation: the residual r(x) at any point, and its norm (handout §3.2).

    r(x) = B̂(x) − E(x) − ρ(x) (H_lamps(x) + ∫ B̂ κ V dA')  [W/m²]       (handout (3.5))

The true error ε = B − B̂ cannot be known (3.3), but r can, and r = −Kε ties the two: where r is
positive the solution is brighter than what it sends itself back. It lives at every point, not
only where the method made it vanish.

The integral over the surfaces is taken exactly, B̂ times Lambert's factor of each element and a
visibility by rays (`Residual.at`, for small solutions: points times elements), or by rays over
the hemisphere (`Residual.by_rays`, for any).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from ...form_factors import point_to_polygon
from ...numerics import Array, fill_chunks, points_at, split_in_four, weights_at
from ...rays import RayCaster
from ..equations import corner_factors, visible_share
from ..links import lamp_irradiance
from ..state import SolverState
from .footprints import Footprints
from .local_pass import LocalPass

CHUNK_PAIRS = 1 << 16
"""Pairs of a point and an element looked at together by one thread; about 60 MB."""

SHADOW_RAYS = 64
"""Rays to each lamp from a point that gathers."""

CONSTANT, DELTA = "constant", "delta"


class Residual:
    """The residual of one solution.

    Parameters
    ----------
    state : SolverState
        A scene and its B̂, from any method.
    """

    def __init__(self, state: SolverState) -> None:
        self._state = state
        self._hierarchy = state.hierarchy
        self._basis, self._values = state.approximation()
        self._row = np.full(state.hierarchy.n_elements, -1, dtype=np.int64)
        self._row[self._basis.leaf] = np.arange(len(self._basis.leaf))

    def radiosity(self, face: Array, barycentric: Array) -> Array:
        """Return B̂ (n, 3) at points of faces [W/m²]; parameters as for `at`."""
        return self._at_leaves(self._hierarchy.leaf_at(face, barycentric), face, barycentric)

    def _at_leaves(self, leaf: Array, face: Array, barycentric: Array) -> Array:
        """Return the same, for known leaves."""
        corners = self._hierarchy.corners[leaf]
        weights = weights_at(corners, self.position(face, barycentric)[:, None])[:, 0]
        return self._basis.evaluate(self._values, self._row[leaf], weights)

    def front_of(self, triangle: Array) -> Array:
        """Return (n,) the faces that are the fronts of triangles with an area."""
        return np.asarray(self._hierarchy.faces.of_triangle[0, triangle])

    def position(self, face: Array, barycentric: Array) -> Array:
        """Return where points of faces lie, (n, 3)."""
        return points_at(self._state.scene.triangles[self._hierarchy.faces.triangle[face]], barycentric)

    def at(self, face: Array, barycentric: Array) -> Array:
        """Return r at points of faces, the integral as a sum over all elements.

        Exact where nothing is partly hidden; there visibility is a ratio of few rays. The nodes of
        a collocation, in order, ask with the same rays as the rows of its matrix.

        Parameters
        ----------
        face : (n,) int
            Sides of triangles, by `Faces.of_triangle`.
        barycentric : (n, 2) float
            Weights of the triangle's second and third corner, whichever side it is.

        Returns
        -------
        residual : (n, 3) float64 [W/m²]
        """
        points, normals = self.position(face, barycentric), self._hierarchy.faces.normal[face]
        settings = self._state.settings
        irradiance = lamp_irradiance(
            self._state.scene.lights, points, normals, self._state.caster, settings.seed, settings.threads
        )
        irradiance += self._from_surfaces(points, normals)
        return self.given(face, barycentric, irradiance)

    def by_rays(self, face: Array, barycentric: Array, rays: int, local: LocalPass | None = None) -> Array:
        """Return r at points of faces, the integral by `rays` cosine-distributed rays a point.

        What emissive faces send out themselves is integrated exactly, like lamps. Elements count
        with their means, linear ones too. Other parameters as for `at`.
        """
        local = LocalPass.of(self._state) if local is None else local
        points, normals = self.position(face, barycentric), self._hierarchy.faces.normal[face]
        at = Footprints(points, normals, np.arange(len(face)))
        direct = local.direct.at(at, rays=SHADOW_RAYS)
        sources = local.gather.at(at, normals, rays, local.elements.leaves_of).sources
        indirect = self.gathered(local)[sources].mean(axis=1)
        return self.given(face, barycentric, direct + indirect)

    def gathered(self, local: LocalPass) -> Array:
        """Return (e + cells + 2, 3): what a gather ray finds [W/m²], elements first, then `LocalPass.beyond`.

        Elements without their own emission, which is direct light.
        """
        beyond = local.elements.beyond()
        table = np.zeros((self._hierarchy.n_elements + len(beyond), 3))
        leaf = self._basis.leaf
        table[leaf] = self._basis.leaf_means(self._values) - self._hierarchy.emission[leaf]
        table[leaf] /= self._hierarchy.opacity_where_hit[leaf, None]
        table[self._hierarchy.n_elements :] = beyond
        return table

    def given(self, face: Array, barycentric: Array, irradiance: Array) -> Array:
        """Return B̂ − E − ρH (n, 3) at points of faces, for (n, 3) all that arrives; see `at`.

        ρ and E are those the solution was made with: means over the leaf elements.
        """
        leaf = self._hierarchy.leaf_at(face, barycentric)
        emission, reflectance = self._hierarchy.emission[leaf], self._hierarchy.reflectance[leaf]
        return np.asarray(self._at_leaves(leaf, face, barycentric) - emission - reflectance * irradiance)

    def norm(self, weights: str = CONSTANT, splits: int = 0, points: int = 2) -> Array:
        """Return |r| = Σ_i |⟨r, W_i⟩| of each channel, (3,) (handout (3.7)).

        Parameters
        ----------
        weights : "constant" or "delta"
            W_i is 1 on element i (3.18; the norm is in W) or sits at its centroid (3.8; in W/m²).
            Galerkin's solution makes every term of the first zero, collocation's of the second.
        splits : int
            Weights on the 4^splits parts of each element: what its own weights do not see.
        points : int
            Each constant weight's integral is the mean over the centroids of 4^points parts.
        """
        if weights not in (CONSTANT, DELTA):
            raise ValueError(f"weights {weights!r} are not '{CONSTANT}' or '{DELTA}'")
        inner = points if weights == CONSTANT else 0
        leaf = self._basis.leaf
        generations = splits + inner
        parts = self._hierarchy.corners[leaf]
        for _ in range(generations):
            parts = split_in_four(parts.reshape(-1, 3, 3))
        face = np.repeat(self._hierarchy.face[leaf], 4**generations)
        residual = self.at(face, self._barycentric(face, parts.reshape(-1, 3, 3).mean(axis=1)))
        if weights == CONSTANT:
            area = np.repeat(self._hierarchy.area[leaf] / 4**splits, 4**splits)
            residual = area[:, None] * residual.reshape(len(area), -1, 3).mean(axis=1)
        return np.asarray(np.abs(residual).sum(axis=0))

    def _barycentric(self, face: Array, points: Array) -> Array:
        """Return (n, 2) weights of the second and third corner of the faces' triangles."""
        triangles = self._state.scene.triangles[self._hierarchy.faces.triangle[face]]
        return weights_at(triangles, points[:, None])[:, 0, 1:]

    def _from_surfaces(self, points: Array, normals: Array) -> Array:
        """Return (n, 3) ∫ B̂ κ V dA' as a sum over the elements that send light."""
        hierarchy, basis, state = self._hierarchy, self._basis, self._state
        lit = np.flatnonzero(self._values[basis.corner].max(axis=(1, 2), initial=0.0) > 0)
        leaf, values = basis.leaf[lit], self._values[basis.corner[lit]]
        corners, leaf_normals = hierarchy.corners[leaf], hierarchy.normal[leaf]
        total = np.zeros((len(points), 3))
        if len(lit):
            factors = _constant_factors if basis.is_constant else corner_factors
            elements = _LitElements(lit, corners, leaf_normals, values)
            add = partial(_sent_by, elements, factors, state.caster, points, normals, state.settings.seed)
            fill_chunks(add, total, len(points), max(CHUNK_PAIRS // len(lit), 1), state.settings.threads)
        return total


class _LitElements(NamedTuple):
    """Elements that send light: (m,), corners (m, 3, 3), normals (m, 3), and values at corners (m, 3, 3)."""

    number: Array
    corners: Array
    normals: Array
    values: Array


def _sent_by(
    elements: _LitElements,
    factors_of: Callable[[Array, Array, Array, Array], Array],
    caster: RayCaster,
    points: Array,
    normals: Array,
    seed: int,
    rows: slice,
) -> Array:
    """Return (r, 3) the irradiance of points by elements [W/m²]."""
    count = len(elements.number)
    point, source = np.divmod(np.arange((rows.stop - rows.start) * count), count)
    point += rows.start
    along = points[point] - elements.corners[source, 0]
    above = np.einsum("nk,nk->n", along, elements.normals[source]) > 0
    point, source = point[above], source[above]
    factors = factors_of(points[point], normals[point], elements.corners[source], elements.normals[source])
    seen = np.flatnonzero(factors.max(axis=1, initial=0.0) > 0)
    point, source, factors = point[seen], source[seen], factors[seen]
    pair = point.astype(np.int64) << 32 | elements.number[source]
    corners, leaf_normals = elements.corners[source], elements.normals[source]
    share = visible_share(caster, points[point], normals[point], corners, leaf_normals, pair, seed)
    arriving = np.einsum("nc,nck->nk", factors, elements.values[source]) * share[:, None]
    own, points_here = point - rows.start, rows.stop - rows.start
    return np.stack([np.bincount(own, channel, minlength=points_here) for channel in arriving.T], axis=1)


def _constant_factors(points: Array, normals: Array, corners: Array, _: Array) -> Array:
    """Return (n, 3) a third of the factor from points to elements, for each corner."""
    return np.repeat(point_to_polygon(points, normals, corners)[:, None] / 3.0, 3, axis=1)
