"""Corrects visibilities, which rays only estimate, by known sums.

From a face that nothing escapes from, all light arrives: ΣFV = 1 over what it receives, and over
what it sends. Form factors are formulas, and a link whose rays all agree is nearly always right.
So what is missing lies with the links that are partly blocked, whose V is a share of few rays:
each takes its part of it by its variance, V (1 − V). A_r F_rs V_rs and A_s F_sr V_sr are corrected
alike, by what both faces lack, so reciprocity stays as good as it was.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...numerics import Array
from ..hierarchy import Hierarchy
from ..links import Links

CORRECTION_ROUNDS = 6
"""How often the lack of receivers and of sources is distributed in turn."""

MAX_CORRECTION = 1.0
"""Maximum that one side adds or takes, as a part of V (1 − V)."""

MIN_EXCHANGE = 1e-9
"""A face exchanges at least this share over uncertain links; otherwise they cannot be corrected."""


def corrected(hierarchy: Hierarchy, links: Links, closed: Array, received: Array, sent: Array) -> Links:
    """Return the links with visibilities that bring faces' sums to 1 within their uncertainty.

    V' = V (1 + (1 − V)(a_r + b_s)), kept between 0 and 1, where a and b are numbers of faces.

    closed (f,) bool: Faces whose sums are known to be 1; those of others stay.
    received, sent (f,): ΣFV over all links: what each face receives of unit radiosity, and the share of its
        light that arrives.
    """
    source = links.source - hierarchy.n_clusters
    rows = np.flatnonzero((source >= 0) & (links.visibility > 0) & (links.visibility < 1))
    faces, area = len(hierarchy.faces), hierarchy.faces.area
    receiver, source = links.receiver[rows], source[rows]
    receiver_face, source_face = hierarchy.face[receiver], hierarchy.face[source]
    visibility = links.visibility[rows].astype(np.float64)
    doubtful = hierarchy.area[receiver] * links.factor[rows] * visibility * (1.0 - visibility)
    # A partly opaque surface receives and sends only that part.
    arriving, leaving = doubtful * hierarchy.opacity[source], doubtful * hierarchy.opacity[receiver]
    at_receivers, at_sources = (
        np.bincount(receiver_face, arriving, faces),
        np.bincount(source_face, leaving, faces),
    )
    of_receiver, of_source = np.zeros(faces), np.zeros(faces)
    for _ in range(CORRECTION_ROUNDS):
        lacking = area * (1.0 - received) - np.bincount(
            receiver_face, arriving * of_source[source_face], faces
        )
        of_receiver = _shared_out(lacking, at_receivers, closed, area)
        lacking = area * (1.0 - sent) - np.bincount(source_face, leaving * of_receiver[receiver_face], faces)
        of_source = _shared_out(lacking, at_sources, closed, area)
    everywhere = links.visibility.copy()
    changed = visibility * (1.0 + (1.0 - visibility) * (of_receiver[receiver_face] + of_source[source_face]))
    everywhere[rows] = np.clip(changed, 0.0, 1.0)
    return replace(links, visibility=everywhere)


def _shared_out(lacking: Array, doubtful: Array, closed: Array, area: Array) -> Array:
    """Return (f,) the correction of each face's exchange over uncertain links [m²]."""
    helps = closed & (doubtful > MIN_EXCHANGE * area)
    return np.where(
        helps, np.clip(lacking / np.where(helps, doubtful, 1.0), -MAX_CORRECTION, MAX_CORRECTION), 0.0
    )
