"""The handout's linear system: basis functions, assembly, matrices, exchange areas.

Also refinement by form factors. For the methods that need all elements beforehand.
"""

from __future__ import annotations

from .assembly import collocation, galerkin, linear, share_overlaps, with_lamps
from .decomposition import describe_sets, independent_sets
from .exchange import exchange_areas
from .fixed_elements import subdivide_evenly
from .form_factor_oracle import source_factor_bounds
from .linear_basis import vertex_basis
from .linear_system import LinearSystem
from .matrix_report import matrix_properties
from .point_exchange import corner_factors, visible_share
from .refine_patch import RefinePatch

__all__ = [
    "LinearSystem",
    "RefinePatch",
    "collocation",
    "corner_factors",
    "describe_sets",
    "exchange_areas",
    "galerkin",
    "independent_sets",
    "linear",
    "matrix_properties",
    "share_overlaps",
    "source_factor_bounds",
    "subdivide_evenly",
    "vertex_basis",
    "visible_share",
    "with_lamps",
]
