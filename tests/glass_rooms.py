"""Scenes with panes of glass, as arrays: everything in front of, behind and around them is matte."""

from __future__ import annotations

from typing import Any

import numpy as np

from radiosity_addon.scene import Scene, SurfaceImages
from tests.rooms import gray, rectangle

COLOR = np.array([0.9, 0.5, 0.2])
"""Of a pane that tints what passes."""

WHOLE = np.ones(3)


def floor(size: float = 2.0) -> np.ndarray:
    """A square floor about the origin that looks up."""
    half = 0.5 * size
    return rectangle((-half, -half, 0.0), (size, 0, 0), (0, size, 0))


def pane(height: float = 0.5, size: float = 20.0) -> np.ndarray:
    """A thin square pane about the axis, so wide that all light of a lamp above passes it."""
    half = 0.5 * size
    return rectangle((-half, -half, height), (size, 0, 0), (0, size, 0))


def closed_pane(height: float = 0.5, size: float = 20.0, thickness: float = 0.02) -> np.ndarray:
    """The upper and lower face of a pane; its rim is left out, for nothing sees it."""
    return np.concatenate([pane(height + thickness, size), pane(height, size)[:, ::-1]])


def glazed(
    matte: np.ndarray, glass: np.ndarray, color: np.ndarray = COLOR, reflectance: float = 0.0, **given: Any
) -> Scene:
    """Return matte triangles with triangles of glass behind them in the list.

    color (3,): What passes at each crossing.
    given: As for `Scene`; `emission` is of the matte triangles.
    """
    count, total = len(matte), len(matte) + len(glass)
    texel = np.zeros((1, 1, 7))
    texel[..., 6] = 1.0 - np.mean(color)
    textured = np.arange(total) >= count
    emission = np.zeros((total, 3))
    emission[:count] = given.pop("emission", 0.0)
    images = SurfaceImages(
        texel, np.full((total, 3, 2), 0.5), textured, passes=np.reshape(color, (1, 1, 3)), glass=textured
    )
    seen = np.full(total, True)
    seen[count:] = ~images.invisible[count:]
    return Scene(
        np.concatenate([matte, glass]),
        gray(total, reflectance),
        emission,
        two_sided=True,
        images=images,
        in_bounces=seen,
        in_shadows=seen,
        **given,
    )
