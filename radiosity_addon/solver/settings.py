"""What the solver can be asked: accuracy, budget and chance."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SolverSettings:
    """Settings of the hierarchical solver and its local pass.

    Parameters
    ----------
    error : float
        BF_ε as a fraction of the light's power: a link is refined while the power it may
        misplace exceeds it (handout §4.2.1, Oracle2).
    min_area : float
        A_ε as a fraction of the scene's lit area: no element becomes smaller.
    shadow_rays : int
        Rays a point and lamp in the local pass, eight times as many in penumbrae.
    max_links : int
        Refinement stops at this budget, the largest errors served first.
    tolerance : float
        Residual at which the iteration stops, relative to the light's power.
    seed : int
    threads : int
        0 means all cores; the result does not depend on it.
    """

    error: float = 1e-4
    min_area: float = 2e-5
    shadow_rays: int = 4
    max_links: int = 6_000_000
    tolerance: float = 1e-4
    seed: int = 0
    threads: int = 0
