"""The Cornell box as arrays, with an emissive lamp: walls in color, two blocks, one side open."""

from __future__ import annotations

import numpy as np

from radiosity_addon.solver import Scene

WHITE, RED, GREEN, LAMP = (0.76, 0.75, 0.74), (0.63, 0.06, 0.05), (0.15, 0.48, 0.09), (0.78, 0.78, 0.78)
EXITANCE = (30.0, 22.0, 12.0)
"""Of the lamp [W/m²]."""

# The corners that Cornell University's Program of Computer Graphics measured [cm]; y is up.
_WALLS = [
    (WHITE, [(552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2)]),
    (WHITE, [(556, 548.8, 0), (556, 548.8, 559.2), (0, 548.8, 559.2), (0, 548.8, 0)]),
    (WHITE, [(549.6, 0, 559.2), (0, 0, 559.2), (0, 548.8, 559.2), (556, 548.8, 559.2)]),
    (GREEN, [(0, 0, 559.2), (0, 0, 0), (0, 548.8, 0), (0, 548.8, 559.2)]),
    (RED, [(552.8, 0, 0), (549.6, 0, 559.2), (556, 548.8, 559.2), (556, 548.8, 0)]),
]
_LAMP = [(343, 548.7, 227), (343, 548.7, 332), (213, 548.7, 332), (213, 548.7, 227)]
_BLOCKS = [
    (165.0, [(130, 65), (82, 225), (240, 272), (290, 114)]),
    (330.0, [(423, 247), (265, 296), (314, 456), (472, 406)]),
]


def cornell_box() -> Scene:
    """Return the box in meters: 32 one-sided triangles; the blocks have no bottoms."""
    quads = list(_WALLS)
    for height, foot in _BLOCKS:
        quads.append((WHITE, [(x, height, z) for x, z in foot]))
        for (x0, z0), (x1, z1) in zip(foot, [*foot[1:], foot[0]], strict=True):
            quads.append((WHITE, [(x0, 0, z0), (x0, height, z0), (x1, height, z1), (x1, 0, z1)][::-1]))
    quads.append((LAMP, _LAMP))
    triangles, reflectance = [], []
    for color, (a, b, c, d) in quads:
        triangles += [(a, b, c), (a, c, d)]
        reflectance += [color, color]
    emission = np.zeros((len(triangles), 3))
    emission[-2:] = EXITANCE
    return Scene(0.01 * np.array(triangles, dtype=float), np.array(reflectance), emission)
