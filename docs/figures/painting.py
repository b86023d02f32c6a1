"""Pictures of a solved room: its elements, painted far to near, seen through Cornell's camera."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from radiosity_addon.solver.hierarchy.nodes import Hierarchy

EYE = np.array([0.0, -8.0, 2.73])
FOCAL = 35.0 / 25.0
EXPOSURE = 2.8


def project(points: np.ndarray) -> np.ndarray:
    """Return (…, 2) image coordinates of (…, 3) points; the camera looks along y."""
    seen = points - EYE
    return FOCAL * seen[..., [0, 2]] / seen[..., 1:2]


def display(radiosity: np.ndarray, exposure: float = EXPOSURE) -> np.ndarray:
    """Return (n, 3) display colors of radiosities [W/m²], as sRGB encodes them."""
    linear = np.clip(exposure * radiosity / np.pi, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.power(linear, 1 / 2.4) - 0.055)


def paint(
    panel: Axes, hierarchy: Hierarchy, leaves: np.ndarray, colors: np.ndarray, edges: float = 0.0
) -> None:
    """Paint the (l,) leaves that face the camera in (l, 3) colors, far to near, lamps last."""
    corners, face = hierarchy.corners[leaves], hierarchy.face[leaves]
    toward = EYE - corners.mean(axis=1)
    facing = np.flatnonzero((toward * hierarchy.faces.normal[face]).sum(axis=1) > 0)
    near = -np.linalg.norm(toward[facing], axis=1)
    lamp = hierarchy.faces.emission[face[facing]].any(axis=1)
    order = facing[np.lexsort((near, lamp))]
    panel.add_collection(
        PolyCollection(
            project(corners[order]),
            facecolors=colors[order],
            edgecolors=(1, 1, 1, 0.35) if edges else colors[order],
            linewidths=edges or 0.3,
        )
    )
    frame(panel)


def lines(panel: Axes, starts: np.ndarray, ends: np.ndarray, color: str, width: float, alpha: float) -> None:
    """Draw segments between (n, 3) points of the room."""
    segments = np.stack([project(starts), project(ends)], axis=1)
    panel.add_collection(LineCollection(segments, colors=color, linewidths=width, alpha=alpha))
    frame(panel)


def frame(panel: Axes) -> None:
    """Show the room's opening and nothing else."""
    panel.set_xlim(-0.495, 0.495)
    panel.set_ylim(-0.49, 0.49)
    panel.set_aspect("equal")
    panel.axis("off")
