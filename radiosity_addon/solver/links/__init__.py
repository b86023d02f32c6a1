"""Links between nodes, with form factor and visibility, and the transport of light over them.

Initial linking, refinement (the oracle), links of lamps, gather and push-pull.
"""

from __future__ import annotations

from .census import elements_by_level, leaves_by_level, linked_leaves, links_by_level
from .cluster_links import ClusterLinks, gather_at_clusters, join_cluster_links, no_cluster_links
from .cluster_pairs import measure_cluster_links
from .element_links import Links, join, measure_links, no_links
from .initial import COARSEST_FAINT, LINK_SLACK, MIN_LINKS, first_links
from .light_at_points import lamp_irradiance
from .light_links import LightLinks, join_light_links, link_lights, no_light_links
from .node_sampling import node_samples
from .pair_factors import element_factors, pair_visibility
from .refine import children_of_cluster_links, children_of_links, misplaced_at_clusters, misplaced_power
from .transport import gather, node_radiosity, pull, push, push_pull, quarters_mean, shared_means

__all__ = [
    "COARSEST_FAINT",
    "LINK_SLACK",
    "MIN_LINKS",
    "ClusterLinks",
    "LightLinks",
    "Links",
    "children_of_cluster_links",
    "children_of_links",
    "element_factors",
    "elements_by_level",
    "first_links",
    "gather",
    "gather_at_clusters",
    "join",
    "join_cluster_links",
    "join_light_links",
    "lamp_irradiance",
    "leaves_by_level",
    "link_lights",
    "linked_leaves",
    "links_by_level",
    "measure_cluster_links",
    "measure_links",
    "misplaced_at_clusters",
    "misplaced_power",
    "no_cluster_links",
    "no_light_links",
    "no_links",
    "node_radiosity",
    "node_samples",
    "pair_visibility",
    "pull",
    "push",
    "push_pull",
    "quarters_mean",
    "shared_means",
]
