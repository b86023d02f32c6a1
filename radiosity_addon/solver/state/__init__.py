"""What every method works on: the state of a solution, a step of the iteration, the power.

Also the memory that a method may use.
"""

from __future__ import annotations

from .anderson import Anderson
from .iteration import bounce, reflect, relative_residual
from .link_record import LinkRecord, leaves_on, nearest_leaf, record_links
from .memory import (
    link_budget,
    most_light_elements,
    refinable,
    refuse_beyond,
    refuse_large_scene,
    refuse_many_faces,
)
from .power import link_closure, power_balance
from .state import SolverState, begin

__all__ = [
    "Anderson",
    "LinkRecord",
    "SolverState",
    "begin",
    "bounce",
    "leaves_on",
    "link_budget",
    "link_closure",
    "most_light_elements",
    "nearest_leaf",
    "power_balance",
    "record_links",
    "refinable",
    "reflect",
    "refuse_beyond",
    "refuse_large_scene",
    "refuse_many_faces",
    "relative_residual",
]
