"""A room in which a box can be put anywhere, to bake after it has moved."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import AreaLight, EnvironmentLight, PointLight, Scene, SunLight
from tests.rooms import box_room, gray, rectangle, solid_box
from tests.unit.texel_scenes import bake_scene

BOX, PANEL = slice(10, 22), slice(22, 24)
"""Triangles of the box, and of a glowing panel."""

PLACE, ELSEWHERE = (0.5, 0.4), (1.8, 1.1)
"""Of the box on the floor [m]."""


def room(
    at: tuple[float, float] = PLACE, turn: float = 0.0, size: float = 1.0, panel: float = 0.0, **settings: Any
) -> BakeScene:
    """A room, open to a sky at one side, with a box at a place, turned by so many degrees.

    `panel` is how far a glowing panel below the ceiling has been pushed [m].
    """
    walls, surface = box_room((3.0, 2.0, 1.6))
    angle = np.radians(turn)
    about = np.array([(np.cos(angle), -np.sin(angle), 0), (np.sin(angle), np.cos(angle), 0), (0, 0, 1.0)])
    box = size * solid_box((-0.2, -0.2, 0.0), (0.2, 0.2, 0.5)) @ about.T + (*at, 0.0)
    glowing = rectangle((1.9 + panel, 0.3, 1.5), (0, 0.3, 0), (0.3, 0, 0))
    triangles = np.concatenate([walls[surface != 3], box, glowing])
    reflectance = gray(len(triangles), 0.6)
    reflectance[BOX] = (0.7, 0.3, 0.2)
    emission = gray(len(triangles), 0.0)
    emission[PANEL] = (14.0, 12.0, 9.0)
    lights = (
        PointLight((1.1, 1.0, 1.3), (22.0, 20.0, 16.0), radius=0.05, name="Bulb"),
        AreaLight((2.9, 1.0, 1.0), (0, 0, 0.6), (0, 0.6, 0), (8.0, 8.0, 9.0), name="Window"),
        SunLight((0.3, 0.7, -0.6), (3.0, 3.0, 2.5), angle=0.02, name="Sun"),
        EnvironmentLight((0.7, 0.8, 1.0), name="World"),
    )
    scene = Scene(triangles, reflectance, emission, lights=lights, **settings)
    return bake_scene(scene, ("Room", 10), ("Box", 12), ("Panel", 2))


def laid_out_as(scene: BakeScene, uv: np.ndarray) -> BakeScene:
    """The same with the lightmap coordinates (t, 3, 2) of another bake."""
    return replace(scene, objects=tuple(replace(item, uv=uv[item.rows]) for item in scene.objects))
