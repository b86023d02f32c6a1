"""What every method works on: the state of a solution, a step of the iteration, the power.

Also the memory that a method may use.
"""

from __future__ import annotations

from .anderson import Anderson
from .iteration import bounce, reflect, relative_residual
from .link_record import LinkRecord, leaves_on, nearest_leaf, record_links
from .memory import (
    least_bytes,
    link_budget,
    lit_sides,
    most_light_elements,
    refinable,
    refuse_beyond,
    refuse_large_scene,
)
from .power import link_closure, power_balance
from .state import SolverState, begin

__all__ = [
    "Anderson",
    "LinkRecord",
    "SolverState",
    "begin",
    "bounce",
    "least_bytes",
    "leaves_on",
    "link_budget",
    "link_closure",
    "lit_sides",
    "most_light_elements",
    "nearest_leaf",
    "power_balance",
    "record_links",
    "refinable",
    "reflect",
    "refuse_beyond",
    "refuse_large_scene",
    "relative_residual",
]
