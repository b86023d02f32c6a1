"""What every method of solving works on, and what a `Solution` is made of."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any, ClassVar, TypeVar

import numpy as np

from ...lights import light_strengths
from ...numerics import Array
from ...rays import RayCaster
from ...scene import Scene, ray_caster
from ..hierarchy import Basis, Hierarchy, constant_basis
from ..links import LightLinks, link_lights, no_light_links, pull
from ..settings import SolverSettings
from .lamp_power import lamps_within_power, light_power


@dataclass(frozen=True)
class HistoryEntry:
    """How far a method was at some time.

    seconds: Since the method began.
    iteration: Iterations, or shots, so far.
    residual: Σ A |E + ρ K B − B| over the elements, relative to the light's power.
    elements, links: How many there were; a matrix has a link for every entry that is not zero.
    """

    seconds: float
    iteration: int
    residual: float
    elements: int
    links: int


@dataclass
class SolverState:
    """A scene being solved; complete when the method's `solve` returns it.

    All arrays over elements have a row for inner elements too: their area means.
    """

    TIMES: ClassVar = ("history", "started")
    """What tells of times: two runs of the same work differ in it alone."""

    scene: Scene
    settings: SolverSettings
    hierarchy: Hierarchy
    caster: RayCaster
    power: float
    """The light's power Φ [W], the largest channel: the unit of BF_ε and of residuals."""
    light_links: LightLinks = field(default_factory=no_light_links)
    irradiance: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(e, 3) float64: area means over every element [W/m²]."""
    radiosity: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(e, 3) float64 [W/m²]"""
    iterations: int = 0
    residual: float = 0.0
    """Σ A |E + ρ K B − B| over the leaves, relative to the light's power."""
    over_budget: float = 0.0
    """Largest misplaced power left unrefined for want of links, relative to Φ; 0 if none."""
    history: list[HistoryEntry] = field(default_factory=list)
    details: dict[str, Any] = field(default_factory=dict)
    """Details of this method for the report."""
    started: float = field(default_factory=time.perf_counter)

    @property
    def n_links(self) -> int:
        """Links between elements; or entries of the matrix that are not zero."""
        return 0

    @property
    def has_light(self) -> bool:
        """Whether there is anything to solve."""
        return self.power > 0.0 and len(self.hierarchy.faces) > 0

    @property
    def reflectance(self) -> Array:
        """(e, 3) float64: of every element."""
        return self.hierarchy.reflectance

    @property
    def emission(self) -> Array:
        """(e, 3) float64: own emission of every element [W/m²]."""
        return self.hierarchy.emission

    def link_lights_to_leaves(self) -> None:
        """Link the lamps and the sky to the leaves as they are, splitting none."""
        nothing_too_small = float("inf")
        self.light_links = link_lights(
            self.hierarchy,
            self.scene.lights,
            self.caster,
            0.0,
            nothing_too_small,
            self.settings.seed,
            self.settings.threads,
        )
        self.keep_lamps_within_power()

    def keep_lamps_within_power(self) -> None:
        """Scale down what links say arrives from lamps that do not send so much."""
        self.light_links = lamps_within_power(
            self.light_links, self.scene, self.hierarchy, self.caster, self.settings.seed
        )

    def direct(self) -> Array:
        """Return (e, 3): the irradiance straight from lamps and sky [W/m²]; meaningful at the leaves."""
        return self.light_links.at_leaves(self.hierarchy, light_strengths(self.scene.lights))

    def set_leaves(self, irradiance: Array, radiosity: Array) -> None:
        """Take (l, 3) values of the leaves, in their order, and average them upward."""
        everywhere = np.zeros((2, self.hierarchy.n_elements, 3))
        everywhere[:, self.hierarchy.leaves] = irradiance, radiosity
        self.irradiance = pull(self.hierarchy, everywhere[0])
        self.radiosity = pull(self.hierarchy, everywhere[1])

    def reset(self) -> None:
        """Start from what the surfaces emit themselves."""
        self.irradiance = np.zeros((self.hierarchy.n_elements, 3))
        self.radiosity = self.emission.copy()

    def shown(self) -> Array:
        """Return (e, 3): the radiosity to show while solving [W/m²]."""
        return self.radiosity

    def approximation(self) -> tuple[Basis, Array]:
        """Return B̂ = Σ B_i N_i (handout (3.1)): the basis, and (n, 3) the unknowns [W/m²]."""
        basis = constant_basis(self.hierarchy)
        return basis, self.radiosity[basis.leaf]

    def closure(self) -> Array:
        """Return (f,) the area mean over each face of ΣFV: 1 in a closed scene."""
        return np.zeros(len(self.hierarchy.faces))

    def balanced_closure(self) -> Array:
        """Return the same as light was exchanged in the end, if the method balances what links lack."""
        return self.closure()

    def note(self) -> None:
        """Add how far the method is to the history."""
        self.history.append(
            HistoryEntry(
                time.perf_counter() - self.started,
                self.iterations,
                self.residual,
                self.hierarchy.n_elements,
                self.n_links,
            )
        )


StateType = TypeVar("StateType", bound=SolverState)


def begin(scene: Scene, settings: SolverSettings, kind: type[StateType]) -> StateType:
    """Prepare a scene for a method: its faces, its ray caster, and the power of its light."""
    started = time.perf_counter()
    caster = ray_caster(scene, settings.threads)
    hierarchy = Hierarchy(scene, scene.sealed)
    power = light_power(scene, hierarchy.faces)
    state = kind(scene, settings, hierarchy, caster, power, started=started)
    state.reset()
    return state
