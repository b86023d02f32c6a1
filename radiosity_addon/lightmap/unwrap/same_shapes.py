"""Which objects are instances of one shape, up to their place and size: they can share a layout."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from .atlas_input import AtlasInput, Float

ALIKE = 1e-4
"""Edges of one shape differ by no more than this part of their mean length: coordinates are rounded."""

SMALLEST = 0.7
"""Objects down to this part of the largest one's size share its layout; they get that much more texels a
meter."""


def same_shapes(objects: Sequence[AtlasInput]) -> list[int]:
    """Return for each object the number of the largest one with its shape; its own if there is no other.

    Polygons, kinds and kept UVs must be the same; mirrored objects are other shapes.
    """
    edges = [_edge_lengths(each) for each in objects]
    sizes = np.array([float(each.sum()) for each in edges])
    shape = list(range(len(objects)))
    known: dict[bytes, list[int]] = {}
    for number in np.argsort(-sizes, kind="stable").tolist():
        of_its_mesh = known.setdefault(_digest(objects[number]), [])
        for largest in of_its_mesh:
            ratio = sizes[number] / max(sizes[largest], 1e-300)
            off = np.abs(edges[number] - ratio * edges[largest]).max(initial=0.0)
            if ratio >= SMALLEST and off <= ALIKE * edges[number].mean():
                shape[number] = largest
                break
        else:
            of_its_mesh.append(number)
    return shape


def _edge_lengths(source: AtlasInput) -> Float:
    """Return (n, 3) the lengths of triangles' edges, at the object's scale."""
    corners = np.asarray(source.triangles, dtype=np.float64).reshape(-1, 3, 3)
    return np.asarray(source.scale * np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1))


def _digest(source: AtlasInput) -> bytes:
    """Return a digest of an object but for its corners."""
    digest = hashlib.sha256(str(len(source.triangles)).encode())
    for values in (source.polygon, source.kind, source.uv):
        digest.update(b"-" if values is None else np.ascontiguousarray(values).tobytes())
    return digest.digest()
