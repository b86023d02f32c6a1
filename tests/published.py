"""Rooms whose light is published or known in closed form, and how bright they are."""

from __future__ import annotations

import numpy as np

from radiosity_addon.solver import PointLight, Scene
from tests.rooms import CEILING, FLOOR, WALLS, area_mean, box_room, gray, gray_scene, rectangle

CUBE_WITH_EMITTING_CEILING = {FLOOR: 0.17122, CEILING: 1.1044, WALLS: 0.18110}
"""Area means of the radiosity of `shining_cube`: Galerkin solutions extrapolated over n = 4 … 20 grids."""

CUBE_MEANS = [CUBE_WITH_EMITTING_CEILING[min(number, WALLS)] for number in range(6)]

CIE_5_8_INDIRECT_LX = {0.2: 26.04, 0.5: 104.17, 0.8: 416.67, 0.9: 937.5, 0.95: 1979.17}
"""Mean indirect illuminance in `cie_5_8` by reflectance (CIE 171:2006)."""

CIE_5_6_WALL_PERCENT = {0.75: 35.901, 1.25: 27.992, 1.75: 21.639, 2.25: 16.716, 2.75: 12.967}
CIE_5_6_CEILING_PERCENT = {0.25: 26.80, 0.75: 30.94, 1.25: 33.98, 1.75: 35.57}
"""Illuminance in `cie_5_6` in percent of the floor's exitance, by z on a wall and by y on the ceiling."""


def shining_cube(n: int = 1, reflectance: float = 0.5) -> Scene:
    """A closed unit cube whose ceiling emits 1."""
    triangles, surface = box_room(n=n)
    return gray_scene(triangles, reflectance, gray(len(triangles), 1.0) * (surface == CEILING)[:, None])


def wall_means(values: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Return (6, 3) area means of (t, 3) values over the surfaces of a `box_room`, t = 12 n²."""
    return np.stack([area_mean(*part) for part in zip(np.split(values, 6), np.split(areas, 6), strict=True)])


def cie_5_8(reflectance: float) -> Scene:
    """A closed cube of edge 4 m with an isotropic point source of 10 000 lm."""
    return gray_scene(box_room((4, 4, 4))[0], reflectance, lights=[PointLight((2, 2, 2), 10_000.0)])


def cie_5_8_indirect(irradiance: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Return the (3,) mean indirect illuminance [lx] of its 12 triangles."""
    return area_mean(irradiance, areas) - 10_000.0 / 96.0


def cie_5_6() -> Scene:
    """A diffuse floor of exitance 100 in a black room."""
    triangles, surface = box_room((4, 4, 3))
    return gray_scene(triangles, 0.0, gray(12, 100.0) * (surface == FLOOR)[:, None])


def parallel_plates() -> Scene:
    """Two plates much larger than their distance, ρ = 0.5, one emits 1: B = 4/3 and 2/3."""
    below = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    above = rectangle((0, 0, 0.0005), (0, 1, 0), (1, 0, 0))
    return gray_scene(
        np.concatenate([below, above]), emission=np.repeat(gray(2, 1.0) * [[1], [0]], 2, axis=0)
    )
