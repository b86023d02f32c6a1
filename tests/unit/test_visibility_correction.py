"""Visibilities corrected by known sums: what is missing goes to links that rays disagree about, both ways."""

from __future__ import annotations

import numpy as np

from radiosity_addon.solver.balance.visibility_correction import corrected
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from radiosity_addon.solver.links.element_links import Links
from tests.rooms import gray_scene, rectangle

ALL = np.ones(4, dtype=bool)
ZERO = np.zeros(4)


def four_faces() -> Hierarchy:
    triangles = np.concatenate(
        [rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), rectangle((0, 0, 1), (0, 1, 0), (1, 0, 0))]
    )
    return Hierarchy(gray_scene(triangles))


def every_pair(hierarchy: Hierarchy, factor: float, visibility: np.ndarray) -> Links:
    """Each of four faces with each other, V as given by (4, 4)."""
    receiver, source = (rows.astype(np.int32) for rows in np.nonzero(~np.eye(4, dtype=bool)))
    number = np.full(len(receiver), factor, dtype=np.float32)
    shares = np.ones((len(receiver), 4), dtype=np.float32)
    seen = visibility[receiver, source].astype(np.float32)
    return Links(receiver, source + hierarchy.n_clusters, number, seen, 0 * number, shares, shares)


def sums(hierarchy: Hierarchy, links: Links) -> tuple[np.ndarray, np.ndarray]:
    """Return ΣFV over what the faces, all of one size, receive and send."""
    at = links.factor * links.visibility
    return np.bincount(links.receiver, at, 4), np.bincount(links.source - hierarchy.n_clusters, at, 4)


def test_doubtful_links_make_up_for_what_is_missing() -> None:
    hierarchy = four_faces()
    visibility = np.array([[0, 1, 0.5, 0.7], [1, 0, 0.6, 0.8], [0.4, 0.6, 0, 1], [0.7, 0.8, 1, 0]])
    links = every_pair(hierarchy, 0.42, visibility)
    before = sums(hierarchy, links)
    assert max(np.abs(np.concatenate(before) - 1.0)) > 0.05
    after = corrected(hierarchy, links, ALL, *before)
    np.testing.assert_allclose(sums(hierarchy, after), 1.0, atol=2e-3)
    sure = links.visibility == 1
    np.testing.assert_array_equal(after.visibility[sure], 1.0)
    changed = (after.visibility - links.visibility)[~sure]
    assert (changed != 0).all()
    assert ((after.visibility > 0) & (after.visibility <= 1)).all()


def test_reciprocal_links_stay_reciprocal() -> None:
    hierarchy = four_faces()
    visibility = np.array([[0, 1, 0.5, 0.7], [1, 0, 0.6, 0.8], [0.5, 0.6, 0, 1], [0.7, 0.8, 1, 0]])
    links = every_pair(hierarchy, 0.42, visibility)
    after = corrected(hierarchy, links, ALL, *sums(hierarchy, links))
    table = np.zeros((4, 4))
    table[after.receiver, after.source - hierarchy.n_clusters] = after.visibility
    np.testing.assert_allclose(table, table.T, atol=2e-3)


def test_faces_whose_sums_are_not_known_keep_theirs() -> None:
    hierarchy = four_faces()
    visibility = np.array([[0, 1, 0.5, 0.7], [1, 0, 0.6, 0.8], [0.5, 0.6, 0, 1], [0.7, 0.8, 1, 0]])
    links = every_pair(hierarchy, 0.42, visibility)
    after = corrected(hierarchy, links, ~ALL, *sums(hierarchy, links))
    np.testing.assert_array_equal(after.visibility, links.visibility)
    # Known of face 0 alone: links that do not touch it stay.
    after = corrected(hierarchy, links, ALL & (np.arange(4) == 0), *sums(hierarchy, links))
    touched = (links.receiver == 0) | (links.source == hierarchy.n_clusters)
    np.testing.assert_array_equal(after.visibility[~touched], links.visibility[~touched])
    assert (after.visibility[touched] != links.visibility[touched]).any()


def test_visibilities_stay_between_none_and_all() -> None:
    hierarchy = four_faces()
    links = every_pair(hierarchy, 0.1, np.full((4, 4), 0.9))
    after = corrected(hierarchy, links, ALL, ZERO, ZERO)
    np.testing.assert_array_equal(after.visibility, np.clip(0.9 * (1 + 0.1 * 2), 0, 1).astype(np.float32))
    links = every_pair(hierarchy, 0.1, np.full((4, 4), 0.1))
    after = corrected(hierarchy, links, ALL, 1 + np.ones(4), 1 + np.ones(4))
    assert (after.visibility >= 0).all()
