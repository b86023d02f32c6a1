"""A room with every kind of light, for relighting: lamps, a sky with a bright patch, emissive faces."""

from __future__ import annotations

from typing import Any

import numpy as np

from radiosity_addon.lights.environment import SkyPatch, pixel_bounds
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import AreaLight, EnvironmentLight, PointLight, Scene
from tests.rooms import box_room, gray, rectangle, solid_box
from tests.unit.texel_scenes import bake_scene

SUN = pixel_bounds((64, 128))[45 * 128 + 70 : 45 * 128 + 72]
"""Bounds of a bright part of the sky: two cells, 36° above the horizon."""

PANEL, SIGN = slice(10, 12), slice(12, 14)
"""The emissive triangles: a panel in one color, and a red sign."""

NAMES = ("Bulb", "Window light", "World", "World", "Panel", "Sign")
"""Of the sources."""

BAKED = np.array([(40.0, 36.0, 30.0), (0, 0, 0), (1.0, 1.2, 1.6), (9.0, 8.0, 6.0), (12.0, 11, 9), (5, 0, 0)])
"""Their strengths, with a lamp that is dark: W, W, W/m²/sr, W/m², W/m², W/m²."""

CHANGED = np.array(
    [(4.0, 6.0, 12.0), (30, 30, 30), (0.5, 0.4, 0.3), (20.0, 22.0, 9.0), (3.0, 9, 2), (0, 4, 1)]
)


def lit_room(strengths: np.ndarray = BAKED) -> Scene:
    """A room with a box in it, open at one side, lit by sources of these strengths."""
    room, surface = box_room((3.0, 2.0, 2.0))
    panel = rectangle((1.0, 0.7, 1.9), (0, 0.6, 0), (0.6, 0, 0))
    sign = rectangle((0.05, 0.5, 1.0), (0, 0.5, 0), (0, 0, 0.4))
    box = solid_box((1.2, 0.6, 0.0), (1.8, 1.1, 0.7))
    triangles = np.concatenate([room[surface != 3], panel, sign, box])
    reflectance = gray(len(triangles), 0.6)
    reflectance[:10][surface[surface != 3] == 2] = (0.7, 0.2, 0.1)
    emission = gray(len(triangles), 0.0)
    emission[PANEL], emission[SIGN] = strengths[4], strengths[5]
    lights = (
        PointLight((2.2, 0.5, 1.4), strengths[0], radius=0.05, name="Bulb"),
        AreaLight((2.9, 1.0, 1.0), (0, 0, 0.6), (0, 0.6, 0), strengths[1], name="Window light"),
        EnvironmentLight(strengths[2], name="World"),
        SkyPatch(strengths[3], SUN, np.ones(2), name="World"),
    )
    return Scene(triangles, reflectance, emission, lights=lights)


def lit_bake(strengths: np.ndarray = BAKED) -> BakeScene:
    """The same, ready to bake."""
    scene = lit_room(strengths)
    emitter = np.zeros(len(scene), dtype=np.int32)
    emitter[SIGN] = 1
    plain: Any = bake_scene(scene, ("Room", 10), ("Panel", 2), ("Sign", 2), ("Box", 12))
    return BakeScene(plain.scene, plain.objects, (), emitter, ("Panel", "Sign"))
