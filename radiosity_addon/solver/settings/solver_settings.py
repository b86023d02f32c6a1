"""The settings of the solver: the method, its accuracy, its limits and its seed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SolverSettings:
    """Settings of the solving methods and of the local pass.

    Which method has which setting: the fields of `BakeSettings`.

    method: "hierarchical", "multi-level", "two-level", "shooting", "conjugate-gradient", "gauss-seidel",
        "jacobi" or "dense".
    error: BF_ε as a fraction of the light's power: a link is refined while the power it may misplace exceeds
        it (handout §4.2.1, Oracle2).
    form_factor_error: F_ε: a link is refined while its form factor may exceed it (handout §4.2, Oracle1).
    min_area: A_ε as a fraction of the scene's lit area: no element becomes smaller.
    elements: About how many elements the methods with fixed elements divide the surfaces into.
    assembly "galerkin", "collocation" or "linear": How the matrix is made: area means, values at centroids,
        or values at vertices.
    patches: About how many patches the two-level method groups its elements into.
    contrast: The two-level method splits neighboring elements whose reflected light differs by more than
        this part of the mean over all.
    ambient: Show the light that shooting has not yet sent as an ambient term.
    shadow_rays: Rays a point and lamp in the local pass, eight times as many in penumbrae.
    max_links: Refinement stops at this budget, the largest errors served first.
    tolerance: Residual at which the iteration stops, relative to the light's power.
    max_iterations: Iterations, or shots, after which it stops anyway.
    memory_limit: GiB; a system that would need more is refused.
    threads: 0 means all cores; the result does not depend on it.
    """

    method: str = "hierarchical"
    error: float = 1e-4
    form_factor_error: float = 0.01
    min_area: float = 2e-5
    elements: int = 2000
    assembly: str = "galerkin"
    patches: int = 200
    contrast: float = 0.1
    ambient: bool = False
    shadow_rays: int = 4
    max_links: int = 6_000_000
    tolerance: float = 1e-4
    max_iterations: int = 100_000
    memory_limit: float = 4.0
    seed: int = 0
    threads: int = 0
