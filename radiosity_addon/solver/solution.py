"""What solving yields: the light on every triangle's two sides, and anywhere between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from functools import cached_property
from typing import Any

import numpy as np

from ..lights import Light
from ..numerics import Array
from .element_transport import MAX_LINKED, Relightable
from .gather import Footprints, LocalPass, Residual
from .state import LinkRecord, SolverState, power_balance, record_links

POINT_RAYS = 1024
"""Hemisphere rays of a single point in `Solution.irradiance`."""


class Solution:
    """A solved scene.

    Attributes
    ----------
    triangle_radiosity, triangle_irradiance : (t, 3) float64
        Area means over the front of each triangle [W/m²].
    back_radiosity, back_irradiance : (t, 3) float64
        The same for the backs; 0 where a triangle is one-sided.
    triangle_closure, back_closure : (t,) float64
        Area mean of ΣFV, as light was exchanged: the share of what leaves a side that arrives at another.
    report : dict
        "method", "elements", "links", "rays", "iterations", "residual", "power_W" (emitted,
        absorbed, escaped), "closure_area_mean" (over the sides that receive light),
        "history" (a dict for each `HistoryEntry`), and details of the method.
    """

    def __init__(self, state: SolverState) -> None:
        self._state = state
        hierarchy = state.hierarchy
        face_count = len(hierarchy.faces)
        shares = state.balanced_closure()
        fronts, backs = self._by_side(shares[:, None])
        self.triangle_closure, self.back_closure = fronts[:, 0], backs[:, 0]
        lit = state.irradiance[:face_count].max(axis=1, initial=0.0) > 0
        lit_area = hierarchy.faces.area * lit
        mean = float(lit_area @ shares / lit_area.sum()) if lit.any() else 0.0
        self.report: dict[str, Any] = {
            "method": state.settings.method,
            "elements": hierarchy.n_elements,
            "links": state.n_links,
            "rays": state.caster.rays,
            "iterations": state.iterations,
            "residual": state.residual,
            "power_W": power_balance(state),
            "closure_area_mean": mean,
            "history": [asdict(entry) for entry in state.history],
            **state.details,
        }

    @property
    def triangle_radiosity(self) -> Array:
        """(t, 3) float64 [W/m²]; made when it is read, as are the next three."""
        return self._by_side(self._state.radiosity)[0]

    @property
    def back_radiosity(self) -> Array:
        """(t, 3) float64 [W/m²]"""
        return self._by_side(self._state.radiosity)[1]

    @property
    def triangle_irradiance(self) -> Array:
        """(t, 3) float64 [W/m²]"""
        return self._by_side(self._state.irradiance)[0]

    @property
    def back_irradiance(self) -> Array:
        """(t, 3) float64 [W/m²]"""
        return self._by_side(self._state.irradiance)[1]

    @property
    def over_budget(self) -> float:
        """Largest share of the light's power a link may misplace that the link budget left; 0 if none."""
        return self._state.over_budget

    @property
    def first_faint(self) -> float:
        """Exchange, as a share of all area, below which first links are coarse for want of them; or 0."""
        return float(self.report.get("hierarchical", {}).get("first_faint", 0.0))

    def final_report(self) -> dict[str, Any]:
        """Return the report with the rays counted that were traced since solving."""
        return {**self.report, "rays": self._state.caster.rays}

    @cached_property
    def local_pass(self) -> LocalPass:
        """The local pass over this solution: direct light and gather rays at points."""
        return LocalPass.of(self._state)

    def relightable(
        self, emitter: Array | None = None, lights: Sequence[Light] | None = None, most: int = MAX_LINKED
    ) -> Relightable:
        """Return what relighting this scene needs.

        Parameters
        ----------
        emitter : (t,) int or None
            Which emissive material each triangle has, see `LightSources`.
        lights, most
            See `Relightable.of`.

        Raises
        ------
        UsageError
            If the method keeps no links.
        """
        return Relightable.of(self._state, emitter, lights, most)

    def link_record(self) -> LinkRecord:
        """Return the elements and links, kept small."""
        return record_links(self._state)

    @property
    def n_elements(self) -> int:
        """How many elements there are, of all levels."""
        return self._state.hierarchy.n_elements

    @property
    def element_residual(self) -> Residual:
        """The residual of the elements' radiosity."""
        return Residual(self._state)

    def irradiance(self, points: Array, normals: Array) -> Array:
        """Return the irradiance at points, direct and indirect.

        Parameters
        ----------
        points : (n, 3) float
            May lie on surfaces.
        normals : (n, 3) float
            The directions they face; need not be unit.

        Returns
        -------
        irradiance : (n, 3) float64 [W/m²]
        """
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        normals = np.asarray(normals, dtype=np.float64).reshape(-1, 3)
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        local = self.local_pass
        at = Footprints(points, normals, np.arange(len(points)))
        direct = local.direct.at(at, rays=64)
        gathered = local.gather.at(at, normals, POINT_RAYS, local.elements.leaves_of)
        radiosity = np.concatenate([local.elements.reflected(), local.elements.beyond()])
        return np.asarray(direct + gathered.mean_of(radiosity))

    def residual(
        self, triangle: Array, barycentric: Array, front: bool | Array = True, rays: int | None = None
    ) -> Array:
        """Return r(x) = B̂ − E − ρ(H_lamps + ∫ B̂ κ V dA') at points of triangles (handout (3.5)).

        Parameters
        ----------
        triangle : (n,) int
        barycentric : (n, 2) float
            Weights of the triangle's second and third corner.
        front : bool or (n,) bool
            Which side of it.
        rays : int or None
            None sums over all elements, point by point; a number gathers with that many rays.

        Returns
        -------
        residual : (n, 3) float64 [W/m²]
            Positive where the solution is too bright for what arrives there.

        Raises
        ------
        ValueError
            If a triangle has no such side.
        """
        triangle = np.asarray(triangle)
        side = np.where(np.broadcast_to(front, triangle.shape), 0, 1)
        face = self._state.hierarchy.faces.of_triangle[side, triangle]
        if (face < 0).any():
            row = int(np.flatnonzero(face < 0)[0])
            raise ValueError(f"triangle {triangle[row]} has no area or no such side")
        residual = self.element_residual
        if rays is None:
            return residual.at(face, barycentric)
        return residual.by_rays(face, barycentric, rays, self.local_pass)

    def _by_side(self, values: Array) -> tuple[Array, Array]:
        """Spread the faces' rows of (f, k) or (e, k) values over triangles' fronts and backs: two (t, k)."""
        faces = self._state.hierarchy.faces
        values = values[: len(faces)]
        sides = np.zeros((2, faces.of_triangle.shape[1], values.shape[1]))
        sides[np.where(faces.front, 0, 1), faces.triangle] = values
        return sides[0], sides[1]
