"""Progressive refinement: shoot from the element with the most unshot power (handout §3.4.2).

Each element keeps two radiosities: B, what it has, and ΔB, the part it has not yet sent on.
One shot sends the ΔB of one element to all others. That takes one column of the matrix, made
from the exchange areas of the pairs it needs. Lamps and the sky shine first, so that
E' = E + ρ H_direct is what there is to shoot.

S = B − ΔB is an iterate whose residual E' − K S is exactly ΔB: a shot is the relaxation of
one row of S, as in Gauss-Seidel, in another order. B is the better of the two, one gather
from S, and is what is shown.

Memory grows as O(n): columns are made for the few elements that will shoot next, together,
which is quicker than one by one, and forgotten when they have shot. An element shoots again
only after nearly all others have, so keeping columns would help by k/n for k of them (of the
latest 64 of 500 in the Cornell box 0.2 % were needed again): that would be the matrix.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array
from ...scene import Scene, arriving, shares
from ..equations import exchange_areas, subdivide_evenly
from ..settings import SolverSettings
from ..state import SolverState, begin, refuse_beyond

HISTORY_STEP = 1.1
"""Shots are noted in the history when their number has grown by this factor: thousands make 100 entries."""

LOOK_AHEAD = 16
"""Columns made at a time: three times as fast as one by one (Cornell box, 500 elements)."""

MOST_COLUMNS = 64
"""Columns that may wait for their shot; 3 % are dropped before (a third if 32 may wait)."""

BYTES_AN_ELEMENT = 2000
"""Memory of an element: tree, light links, radiosities, its part of the columns."""


@dataclass
class ShootingState(SolverState):
    """State of shooting; arrays over the l leaves, in the order of `leaves`."""

    leaves: Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(l,) int: the elements."""
    received: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(l, 3) float64: H, the light of lamps and of all shots [W/m²]."""
    unshot: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(l, 3) float64: ΔB [W/m²]."""
    reach: Array = field(default_factory=lambda: np.zeros(0))
    """(l,) float64: ΣFV of the elements that have shot; of others, to those that have."""
    shots_of: Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(l,) int: how often each element has shot."""
    columns: dict[int, Array] = field(default_factory=dict)
    """At most `MOST_COLUMNS` columns of (l,) F_ji, by the place of i among the leaves."""
    pairs: int = 0
    """Exchange areas computed."""

    @property
    def n_links(self) -> int:
        """Pairs over which light was sent, counted again for each shot."""
        return self.iterations * max(len(self.leaves) - 1, 0)

    def power_to_shoot(self) -> Array:
        """Return (l,) A ΔB [W], the largest channel."""
        return np.asarray(self.hierarchy.area[self.leaves] * self.unshot.max(axis=1))

    def unshot_power(self) -> Array:
        """Return (3,) Σ A ΔB [W] of each channel."""
        return np.asarray(self.hierarchy.area[self.leaves] @ self.unshot)

    def ambient(self) -> Array:
        """Return (3,) the ambient radiosity a: the unshot light, spread evenly, with all its bounces.

        a = (ΣAΔB / ΣA) / (1 − ρ̄) with the area mean ρ̄ of the reflectance (Cohen, Chen,
        Wallace and Greenberg 1988); exact if all surfaces of a closed room are equal.
        """
        area = self.hierarchy.area[self.leaves]
        mean = area @ self.reflectance[self.leaves] / area.sum()
        return np.asarray(self.unshot_power() / area.sum() / (1.0 - mean))

    def shown(self) -> Array:
        """Return (e, 3): B, with the ambient term ρ a if the settings enable it [W/m²]."""
        if not self.settings.ambient or not len(self.leaves):
            return self.radiosity
        return np.asarray(self.radiosity + self.reflectance * self.ambient())

    def closure(self) -> Array:
        """Return (f,) the area mean over each face of ΣFV; too low where elements never shot."""
        faces = self.hierarchy.faces
        if not len(self.leaves):
            return np.zeros(len(faces))
        power = self.hierarchy.area[self.leaves] * self.reach
        per_face = np.bincount(self.hierarchy.face[self.leaves], power, minlength=len(faces))
        return np.asarray(per_face / faces.area)


def solve(scene: Scene, settings: SolverSettings, progress: Progress = SILENT) -> ShootingState:
    """Shoot until little power is unshot; `progress` receives the state after every shot.

    Ends when ΣAΔB / Φ is below `settings.tolerance` in every channel, or after
    `settings.max_iterations` shots. `state.residual` is ΣAΔB / Φ, the residual of S; that of
    B is smaller, by ρ and by what leaves the scene.

    Raises UsageError if even the elements alone would not fit into the memory limit.
    """
    state = begin(scene, settings, ShootingState)
    progress.at(0.01, state)
    if not state.has_light:
        return state
    refuse_too_many(len(state.hierarchy.faces), settings)
    subdivide_evenly(state.hierarchy, settings.elements)
    state.link_lights_to_leaves()
    start(state)
    state.note()
    progress.at(0.05, state)
    first, next_note = state.residual, 1.0
    while state.residual > settings.tolerance and state.iterations < settings.max_iterations:
        shoot(state)
        if state.iterations >= next_note:
            state.note()
            next_note *= HISTORY_STEP
        progress.at(0.05 + 0.94 * _fraction(first, state), state)
    if state.history[-1].iteration < state.iterations:
        state.note()
    state.details["shooting"] = {
        "shots": state.iterations,
        "elements_that_shot": int((state.shots_of > 0).sum()),
        "pairs": state.pairs,
    }
    return state


def start(state: ShootingState) -> None:
    """Start with the light of lamps and emission: B = ΔB = E' = E + ρ H_direct, nothing shot yet."""
    state.reset()
    state.leaves = state.hierarchy.leaves
    state.received = state.direct()[state.leaves]
    leaves = state.leaves
    state.unshot = state.emission[leaves] + state.reflectance[leaves] * state.received
    state.reach = np.zeros(len(leaves))
    state.shots_of = np.zeros(len(leaves), dtype=np.int64)
    _show(state)


def shoot(state: ShootingState) -> int:
    """Shoot once, from the element with the most unshot power; return its place among the leaves.

    ΔB_j += ρ_j F_ji ΔB_i and B_j += the same for every j, F_ji = A_i F_ij / A_j; ΔB_i = 0.
    """
    area = state.hierarchy.area[state.leaves]
    brightest = int(np.argmax(state.power_to_shoot()))
    factors = column(state, brightest)
    arriving = factors[:, None] * state.unshot[brightest]
    state.unshot[brightest] = 0.0
    state.received += arriving
    state.unshot += state.reflectance[state.leaves] * arriving
    if state.shots_of[brightest] == 0:
        state.reach[state.shots_of == 0] += factors[state.shots_of == 0]
        state.reach[brightest] = float(area @ factors) / area[brightest]
    state.shots_of[brightest] += 1
    state.iterations += 1
    _show(state)
    return brightest


def column(state: ShootingState, source: int) -> Array:
    """Return (l,) F_ji of all leaves j to the leaf i = leaves[`source`]: column i of the matrix F."""
    if source not in state.columns:
        if len(state.columns) > MOST_COLUMNS - LOOK_AHEAD:
            state.columns.clear()
        _make_columns(state, source)
    return state.columns.pop(source)


def _make_columns(state: ShootingState, source: int) -> None:
    """Make the columns of `source` and of the others with the most power that have none yet."""
    leaves = state.leaves
    power = state.power_to_shoot()
    power[list(state.columns)] = 0.0
    power[source] = np.inf  # among equals it might not be chosen
    count = min(LOOK_AHEAD, len(leaves))
    chosen = np.argpartition(power, len(leaves) - count)[-count:]
    chosen = chosen[power[chosen] > 0.0]
    one, other = np.repeat(leaves[chosen], len(leaves)), np.tile(leaves, len(chosen))
    settings = state.settings
    exchange = exchange_areas(state.hierarchy, state.caster, one, other, settings.seed, settings.threads)
    exchange = exchange.reshape(len(chosen), -1)
    # Coplanar faces are hit twice: a shot still sends no more than it has (see `overlaps`).
    taken = arriving(exchange, state.hierarchy.opacity[leaves])
    exchange *= shares(taken / state.hierarchy.area[leaves[chosen]])[:, None]
    factors = exchange / state.hierarchy.area[leaves]
    state.columns |= {int(place): row.copy() for place, row in zip(chosen, factors, strict=True)}
    state.pairs += len(chosen) * (len(leaves) - 1)


def _show(state: ShootingState) -> None:
    """Bring the state's radiosity B, irradiance and residual up to date."""
    leaves = state.leaves
    radiosity = state.emission[leaves] + state.reflectance[leaves] * state.received
    state.set_leaves(state.received, radiosity)
    state.residual = float(state.unshot_power().max()) / state.power


def _fraction(first: float, state: ShootingState) -> float:
    """Return the progress by the residual or by the number of shots, on a logarithmic scale."""
    target = max(state.settings.tolerance, 1e-16)
    fallen = np.log(first / max(state.residual, target)) / max(np.log(first / target), 1e-9)
    return float(min(max(fallen, state.iterations / state.settings.max_iterations), 1.0))


def refuse_too_many(faces: int, settings: SolverSettings) -> None:
    """Refuse scenes whose elements alone exceed the memory limit; there is at least one per face."""
    count = max(faces, settings.elements)
    what = f"shooting between {count} elements"
    advice = "use fewer elements, raise the limit, or bake fewer objects"
    refuse_beyond(settings.memory_limit, count * BYTES_AN_ELEMENT, what, advice)
