"""Scenes with panes of glass, as arrays: everything in front of, behind and around them is matte."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from radiosity_addon.lights import EnvironmentLight
from radiosity_addon.scene import BakeScene, Scene, SurfaceImages
from tests.relit_rooms import BAKED, lit_room
from tests.rooms import gray, rectangle, solid_box
from tests.unit.texel_scenes import bake_scene

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


PAINTED_PASSES, PAINTED_REFLECTANCE = np.array([0.2, 0.06, 0.78]), np.array([0.38, 0.81, 0.99])
"""Of paint added to glass: of blue 1.42 of what arrives would be sent on, if nothing bounded it."""


def painted_boxes(
    *half_sizes: float, passes: np.ndarray = PAINTED_PASSES, reflectance: np.ndarray = PAINTED_REFLECTANCE
) -> Scene:
    """A white floor and closed boxes in one another that pass and reflect, under a sky of radiance 1."""
    boxes = [solid_box((-s, -s, 0.05), (s, s, 0.05 + 2 * s)) for s in half_sizes]
    scene = glazed(floor(), np.concatenate(boxes), passes, reflectance=0.8)
    images = scene.images
    assert images is not None
    values = images.values.copy()
    values[..., :3] = reflectance
    return Scene(
        scene.triangles,
        scene.reflectance,
        scene.emission,
        two_sided=True,
        lights=[EnvironmentLight((1.0, 1.0, 1.0))],
        images=SurfaceImages(values, images.image_uv, images.textured, images.passes, images.glass),
    )


WINDOW_COLOR, SCREEN_COLOR = np.array([0.8, 0.9, 0.6]), np.array([0.9, 0.4, 0.3])
"""Of a window that closes `lit_room`, and of a screen in its middle."""


def glazed_room(strengths: np.ndarray = BAKED, screen: np.ndarray = SCREEN_COLOR) -> BakeScene:
    """`relit_rooms.lit_room` with a window in its open side, and a screen that its box pokes through.

    The window is a part of the room, which gets a lightmap all the same; the screen is an object of its own.
    """
    room = lit_room(strengths)
    window = rectangle((3.0, 0.0, 0.0), (0, 2.0, 0), (0, 0, 2.0))
    parts = [
        room.triangles[:10],
        window,
        room.triangles[10:],
        rectangle((1.5, 0.0, 0.0), (0, 2, 0), (0, 0, 1.5)),
    ]
    triangles = np.concatenate(parts)
    count = len(triangles)
    is_window, is_screen = np.zeros((2, count), dtype=bool)
    is_window[10:12], is_screen[-2:] = True, True
    matte = ~(is_window | is_screen)
    reflectance, emission = gray(count, 0.0), gray(count, 0.0)
    reflectance[matte], emission[matte] = room.reflectance, room.emission
    # Two texels: the window's and the screen's.
    values, passes = np.zeros((1, 2, 7)), np.stack([WINDOW_COLOR, screen])[None]
    values[..., 6] = 1.0 - passes.mean(axis=2)
    uv = np.full((count, 3, 2), 0.25)
    uv[is_screen] = (1.0, 0.5)
    uv[is_window] = (0.0, 0.5)
    images = SurfaceImages(values, uv, ~matte, passes, ~matte)
    scene = Scene(triangles, reflectance, emission, two_sided=~matte, lights=room.lights, images=images)
    plain = bake_scene(scene, ("Room", 12), ("Panel", 2), ("Sign", 2), ("Box", 12), ("Screen", 2))
    objects = tuple(
        replace(
            item, glass=~matte[item.rows] if (~matte[item.rows]).any() else None, bake=item.name != "Screen"
        )
        for item in plain.objects
    )
    emitter = np.zeros(count, dtype=np.int32)
    emitter[14:16] = 1
    return BakeScene(scene, objects, (), emitter, ("Panel", "Sign"))
