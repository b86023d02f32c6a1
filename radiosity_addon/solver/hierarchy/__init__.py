"""The hierarchy of nodes: clusters above the faces, elements below them.

Also the cut through the clusters that links go down to, and basis functions over the leaves.
"""

from __future__ import annotations

from .adjacency import neighbors
from .basis import Basis, constant_basis
from .bounds import NodeShapes
from .cluster_cut import ClusterCut
from .clusters import Clusters
from .nodes import LEAF, Hierarchy, node_opacity

__all__ = [
    "LEAF",
    "Basis",
    "ClusterCut",
    "Clusters",
    "Hierarchy",
    "NodeShapes",
    "constant_basis",
    "neighbors",
    "node_opacity",
]
