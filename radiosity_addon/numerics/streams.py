"""Which streams of random numbers there are: what each use adds to the seed of a bake.

A sample depends on its seed, its row's key and its index (`sampling.py`). Uses with keys of one kind take
streams of their own, or their samples would be the same. There are keys of pairs of nodes, of nodes
(elements, faces, clusters), of points (texels, sub-cells) and of rays; streams of different kinds may have
one number.
"""

from __future__ import annotations

from enum import IntEnum


class Stream(IntEnum):
    """What is added to a seed; members of the same number are one stream, see `SHARED`."""

    # Of pairs: links between elements, and links to clusters.
    PAIR_TURN = 0
    PAIR_RECEIVER = 1
    PAIR_SOURCE = 2
    PAIR_SOURCE_FACE = 3
    CLUSTER_PAIR_TURN = 0
    CLUSTER_PAIR_RECEIVER = 1
    CLUSTER_PAIR_RECEIVER_FACE = 2
    CLUSTER_PAIR_SOURCE = 3
    CLUSTER_PAIR_SOURCE_FACE = 4

    # Of nodes and their pieces: links from lamps and the sky.
    LIGHT_RAYS = 0
    LIGHT_POINTS = 1

    # Of nodes: the share of light that arrives anywhere.
    ENCLOSURE_POINTS = 41
    ENCLOSURE_FACE = 42
    ENCLOSURE_DIRECTIONS = 42

    # Of rays by their number: the power that is lost, from surfaces and from lamps.
    ESCAPE_POINTS = 11
    ESCAPE_DIRECTIONS = 12
    LAMP_ORIGINS = 21
    LAMP_DIRECTIONS = 22

    # Of points: gathered light.
    FOOTPRINT = 2
    GATHER_DIRECTIONS = 3
    GATHER_STARTS = 4
    AIMED_DIRECTIONS = 5
    AIMED_STARTS = 6

    # Of points: shadow rays to emissive groups and to lamps, which these are added to; the last one to the
    # streams of rays that follow the first to many lamps.
    EMITTER_SHADOWS = 17
    LAMP_SHADOWS = 31
    SHADOW_RAYS = 1
    SHADOW_STARTS = 2
    LEARNED_SHADOWS = 2

    # Of triangles, without the bake's seed.
    BACK_PROBES = 83


LIGHT_STEP, LAMP_STEP, SHADOW_STEP = 101, 2, 7
"""From one light's streams to the next one's: of links, of lost power, of shadow rays."""

SHARED = {
    frozenset({"PAIR_TURN", "CLUSTER_PAIR_TURN", "LIGHT_RAYS"}): "pairs of elements, of clusters; nodes",
    frozenset(
        {"PAIR_RECEIVER", "CLUSTER_PAIR_RECEIVER", "LIGHT_POINTS", "SHADOW_RAYS"}
    ): "pairs of elements, of clusters; nodes; added to the streams of shadows",
    frozenset(
        {"PAIR_SOURCE", "CLUSTER_PAIR_RECEIVER_FACE", "FOOTPRINT", "SHADOW_STARTS", "LEARNED_SHADOWS"}
    ): "pairs of elements, of clusters; points; added to the streams of shadows",
    frozenset({"PAIR_SOURCE_FACE", "CLUSTER_PAIR_SOURCE", "GATHER_DIRECTIONS"}): "pairs; points",
    frozenset({"CLUSTER_PAIR_SOURCE_FACE", "GATHER_STARTS"}): "pairs; points",
    frozenset(
        {"ENCLOSURE_FACE", "ENCLOSURE_DIRECTIONS"}
    ): "the same nodes: where in a cluster a ray starts goes along with where it goes",
}
"""Streams of the same number, and which kinds of keys keep them apart. From the third emissive group on,
`EMITTER_SHADOWS` are those of a lamp as well: the same points, but other lamps."""
