"""Links between elements: form factor, visibility and error estimate.

A link (receiver r, source s) carries the unoccluded form factor F_rs by formula and the
visibility V_rs by rays, apart. Both are area means. Near pairs get the exact factor, far
ones Lambert's point-to-polygon formula at a few points; clusters are sampled.

Rays join the quarters of the two sides: at first four, one from each quarter to each
quarter; where they disagree all sixteen. Four agreeing rays are no proof, so every link
also carries an *error estimate*: how much its F·V may vary or be wrong.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...form_factors import point_to_polygon
from ...numerics import Array, map_chunks, split_in_four
from ...rays import RayCaster
from ..hierarchy import Hierarchy
from .pair_factors import PairSamples, element_factors, gray, open_share, trace_pairs

CHUNK = 1 << 15
"""Pairs measured at once: 16 samples of 48 bytes each bound the temporaries to about 100 MB."""


@dataclass(frozen=True)
class Links:
    """l links as arrays; the multi-level method's are float64, with their visibility in the factor.

    receiver (l,) int32: Element.
    source (l,) int32: Node: a cluster, or n_clusters + element.
    factor (l,) float32: F_rs, the unoccluded fraction of what leaves the receiver that arrives at the source.
    visibility (l,) float32: Share of F_rs that is not blocked.
    error_estimate (l,) float32: Standard deviation of F·V over the samples and what too few rays may have
        missed.
    to_quarter, of_quarter (l, 4) float32: How F·V is distributed over the receiver's and the source's
        quarters, mean 1 each: so leaves below an inner element do not all inherit the same (a cluster's are
        all 1).
    tint (l, 3) float32: What the light of each channel is multiplied with, mean 1, where links lead through
        glass; None without any.
    """

    STORED = ("receiver", "source", "factor", "visibility", "to_quarter", "of_quarter", "tint")

    receiver: Array
    source: Array
    factor: Array
    visibility: Array
    error_estimate: Array
    to_quarter: Array
    of_quarter: Array
    tint: Array | None = None

    def __len__(self) -> int:
        return len(self.receiver)

    def take(self, rows: Array) -> Links:
        """Return the links of a boolean mask or of row numbers."""
        return Links(
            self.receiver[rows],
            self.source[rows],
            self.factor[rows],
            self.visibility[rows],
            self.error_estimate[rows],
            self.to_quarter[rows],
            self.of_quarter[rows],
            None if self.tint is None else self.tint[rows],
        )

    def sorted_by_receiver(self) -> Links:
        """Return them in order of receiver, which `transport.gather` needs."""
        return self.take(np.argsort(self.receiver, kind="stable"))


def no_links() -> Links:
    """Return an empty set of links."""
    return join([])


def join(parts: list[Links]) -> Links:
    """Concatenate sets of links."""
    joined = []
    for name, kind, shape in (
        ("receiver", np.int32, (0,)),
        ("source", np.int32, (0,)),
        ("factor", np.float32, (0,)),
        ("visibility", np.float32, (0,)),
        ("error_estimate", np.float32, (0,)),
        ("to_quarter", np.float32, (0, 4)),
        ("of_quarter", np.float32, (0, 4)),
    ):
        arrays = [getattr(part, name) for part in parts] or [np.zeros(shape)]
        joined.append(np.concatenate(arrays).astype(kind, copy=False))
    return replace(Links(*joined), tint=join_tints([(part.tint, len(part)) for part in parts]))


def join_tints(parts: list[tuple[Array | None, int]]) -> Array | None:
    """Put the tints (l, 3) of sets of l links one after the other; None if no set has any."""
    if all(tint is None for tint, _ in parts):
        return None
    return np.concatenate(
        [np.ones((count, 3), np.float32) if tint is None else tint for tint, count in parts]
    )


def measure_links(
    hierarchy: Hierarchy,
    caster: RayCaster,
    receiver: Array,
    source: Array,
    seed: int,
    threads: int = 0,
    progress: Progress = SILENT,
) -> Links:
    """Compute factor, visibility and error estimate of new links; pairs that face away are left out.

    receiver, source (n,) int: Elements and nodes.
    seed: Places the samples, together with the pair's own numbers.
    threads: 0 means all cores; the links do not depend on it.
    Returns links: At most n.
    """
    measure = partial(_measure_chunk, hierarchy, caster, receiver, source, seed)
    return join([links for _, links in map_chunks(measure, len(receiver), CHUNK, threads, progress)])


def _measure_chunk(
    hierarchy: Hierarchy, caster: RayCaster, receiver: Array, source: Array, seed: int, rows: slice
) -> Links:
    receiver, source = receiver[rows], source[rows]
    is_cluster = source < hierarchy.n_clusters
    factor = np.zeros(len(receiver))
    single = np.flatnonzero(~is_cluster)
    factor[single] = element_factors(hierarchy, receiver[single], source[single] - hierarchy.n_clusters)
    kept = np.flatnonzero(is_cluster | (factor > 0))
    receiver, source, factor, is_cluster = receiver[kept], source[kept], factor[kept], is_cluster[kept]

    samples = PairSamples(hierarchy, receiver, source, seed)
    transfer = samples.transfer
    factor = np.where(is_cluster, transfer.mean(axis=1), factor)
    traced, free = trace_pairs(caster, samples)
    visibility, tint = open_share(transfer, traced, free)
    free = gray(free)
    rays = traced.sum(axis=1)
    # The variation of F·V over the pair, and the share that few rays can have missed.
    passed = np.where(traced, transfer * free, 0.0)
    mean = passed.sum(axis=1) / np.maximum(rays, 1)
    square = (passed**2).sum(axis=1) / np.maximum(rays, 1)
    spread = np.sqrt(np.maximum(square - mean**2, 0.0))
    estimate = np.hypot(np.minimum(spread, 1.0), factor / (rays + 2.0))
    links = Links(
        receiver.astype(np.int32),
        source.astype(np.int32),
        factor.astype(np.float32),
        visibility.astype(np.float32),
        estimate.astype(np.float32),
        *_quarter_shares(hierarchy, receiver, source, samples, transfer * np.where(traced, free, 1.0)),
        tint,
    )
    return links.take(factor > 0)


def _quarter_shares(
    hierarchy: Hierarchy, receiver: Array, source: Array, samples: PairSamples, passed: Array
) -> tuple[Array, Array]:
    """Distribute links over their receiver's and source's quarters: two (n, 4) float32 of mean 1.

    In proportion to Lambert's factor at the quarters' centroids, times what the samples
    of each quarter saw.
    """
    open_to, open_of = samples.by_quarter(samples.transfer)
    seen_to, seen_of = samples.by_quarter(passed)
    shares = np.ones((2, len(receiver), 4))
    single = np.flatnonzero(source >= hierarchy.n_clusters)
    element = source[single] - hierarchy.n_clusters
    for number, (on, toward) in enumerate(((receiver[single], element), (element, receiver[single]))):
        points = split_in_four(hierarchy.corners[on]).mean(axis=2).reshape(-1, 3)
        normals = np.repeat(hierarchy.faces.normal[hierarchy.face[on]], 4, axis=0)
        polygons = np.repeat(hierarchy.corners[toward], 4, axis=0)
        shares[number, single] = point_to_polygon(points, normals, polygons).reshape(-1, 4)
    shares[0] *= np.where(open_to > 0, seen_to / np.maximum(open_to, 1e-300), 1.0)
    shares[1, single] *= np.where(open_of > 0, seen_of / np.maximum(open_of, 1e-300), 1.0)[single]
    mean = shares.mean(axis=2, keepdims=True)
    shares = np.where(mean > 0, shares / np.where(mean > 0, mean, 1.0), 1.0).astype(np.float32)
    return shares[0], shares[1]
