"""The office put together as a Blender scene: a room of 10 m × 7 m, its lamps, its sky and a camera."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np

from . import furniture
from .blender_parts import COLORS, add, add_mesh, diffuse, even_sky, glowing
from .shapes import Shape, box, join, polygon, reveal, wall_with_holes

WIDTH, DEPTH, HEIGHT = 10.0, 7.0, 2.9
WINDOWS = tuple((x, 0.9, x + 1.8, 2.5) for x in (0.7, 3.0, 5.3, 7.6))
"""x₀, z₀, x₁, z₁ in the wall y = 0."""
REVEAL = 0.25

DESKS = tuple((x, y) for y in (1.7, 3.7) for x in (1.6, 4.0, 6.4))
TABLE = (8.3, 5.0)
PANELS = tuple((x, y) for y in (1.8, 4.4) for x in (1.8, 4.4, 7.0))

SKY = (2.6, 3.4, 4.6)
"""Radiance [W/m²/sr]."""
PANEL_POWER, DESK_LAMP_POWER, BULB_RADIANCE, SCREEN_RADIANCE = 55.0, 4.0, 90.0, 1.5

LAMP_TURN = -40
"""Of the desk lamps [°]: their heads hang over the desk, away from the monitors' edges."""

GLOWS = {"Bulb": BULB_RADIANCE, "Screen": SCREEN_RADIANCE}


def build_office(detail: float = 1.0, ceiling_lamps: int = 0) -> bpy.types.Scene:
    """Fill the empty open file.

    Parameters
    ----------
    detail : float
        1 for 39,000 triangles; less makes round things coarser and leaves furniture out.
    ceiling_lamps : int
        So many small lamps under the ceiling instead of panels and desk lamps, of the same power together.
    """
    scene = bpy.context.scene
    scene.name = "Office"
    materials = {name: diffuse(name, color) for name, color in COLORS.items()}
    materials |= {name: glowing(name, radiance) for name, radiance in GLOWS.items()}
    for name, shape in pieces(detail):
        add_mesh(scene, name, shape, materials)
    if ceiling_lamps:
        _add_ceiling_lamps(scene, ceiling_lamps)
    else:
        _add_lamps(scene, detail)
    even_sky(scene, SKY)
    _add_camera(scene)
    return scene


def pieces(detail: float) -> Iterator[tuple[str, Shape]]:
    """Yield every object's name and shape."""
    random = np.random.default_rng(4)
    around = max(6, 2 * round(12 * detail**0.5))
    yield from _room()
    for number, (x, y) in enumerate(_some(DESKS, detail)):
        top = 0.74
        yield f"Desk {number}", furniture.desk().at(x, y)
        turn = random.uniform(-35, 35)
        chair = furniture.office_chair(around).turned(turn)
        yield f"Chair {number}", chair.at(x + random.uniform(-0.15, 0.05), y - 0.75)
        yield f"Monitor {number}", furniture.monitor().at(x - 0.1, y + 0.2, top)
        things = [furniture.keyboard(around).at(x - 0.1, y - 0.12, top)]
        things.append(furniture.mug(min(around, 16)).at(x + 0.35, y - 0.05, top))
        papers = box("Paper", (0.21, 0.3, 0.012 + 0.05 * random.random()), False)
        things.append(papers.turned(random.uniform(-20, 20)).at(x - 0.58, y - 0.1, top))
        yield f"On Desk {number}", join(things)
        if number % 2 == 0:
            lamp = furniture.desk_lamp(around).turned(LAMP_TURN)
            yield f"Desk Lamp {number}", lamp.at(x - 0.7, y + 0.25, top)
    for number in range(3 if detail >= 0.5 else 1):
        case = (
            furniture.bookcase(random, max(1, round(5 * detail)))
            .turned(180)
            .at(3.1 + 1.05 * number, DEPTH - 0.002)
        )
        yield f"Bookcase {number}", case
    yield "Pendant", furniture.pendant(2 * around).at(*TABLE, HEIGHT)
    if detail < 0.5:
        return
    places = ((9.4, 0.7), (0.6, 6.3), (6.6, 6.4))
    for number, (x, y) in enumerate(_some(places, detail)):
        yield f"Plant {number}", furniture.plant(random, max(4, round(46 * detail))).at(x, y)
    yield "Round Table", furniture.round_table(2 * around).at(*TABLE)
    for number, angle in enumerate(_some((20, 110, 200, 290), detail)):
        seat = furniture.office_chair(around).turned(90).at(x=0.95).turned(angle)
        yield f"Visitor Chair {number}", seat.at(*TABLE)
    yield "Sofa", furniture.sofa(around).turned(-90).at(0.5, 4.9)
    for number, window in enumerate(_some(WINDOWS, detail)):
        x = (window[0] + window[2]) / 2
        yield f"Radiator {number}", furniture.radiator(max(4, round(18 * detail))).at(x, 0.1)
        if number % 2:
            yield f"Blind {number}", furniture.blind(24, 1.76).at(x, -0.06, 2.49)
    yield "Bin", furniture.waste_bin(around).at(2.75, 1.9)
    yield "Picture", furniture.picture(1.4, 0.9, "Yellow").turned(90).at(WIDTH, 3.4, 1.2)
    yield "Door", furniture.door().turned(90).at(WIDTH - 0.001, 6.1)


def _room() -> Iterator[tuple[str, Shape]]:
    """Yield the shell, single faces that meet at their edges, seen from inside, and what is built in.

    Nothing lies in the shell's planes: it stands a millimeter off, or goes a centimeter through.
    """
    x, y, z = WIDTH, DEPTH, HEIGHT
    yield "Floor", polygon("Floor", (0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0))
    yield "Ceiling", polygon("Ceiling", (0, 0, z), (0, y, z), (x, y, z), (x, 0, z))
    yield "Back Wall", polygon("Wall", (0, y, 0), (x, y, 0), (x, y, z), (0, y, z))
    yield "Left Wall", polygon("Accent", (0, 0, 0), (0, y, 0), (0, y, z), (0, 0, z))
    yield "Right Wall", polygon("Wall", (x, 0, 0), (x, 0, z), (x, y, z), (x, y, 0))
    yield (
        "Window Wall",
        join(
            [wall_with_holes("Wall", x, z, WINDOWS), *(reveal("Wall", window, REVEAL) for window in WINDOWS)]
        ),
    )
    frames = []
    for x_0, z_0, x_1, z_1 in WINDOWS:
        middle, width, height = (x_0 + x_1) / 2, x_1 - x_0, z_1 - z_0
        upright = box("White", (0.06, 0.06, height + 0.02))
        across = box("White", (width + 0.02, 0.05, 0.06))
        frames += [upright.at(left, -0.2, z_0 - 0.01) for left in (x_0 + 0.031, middle, x_1 - 0.031)]
        frames += [across.at(middle, -0.2, low) for low in (z_0 + 0.001, z_1 - 0.061)]
        frames.append(box("White", (width + 0.1, 0.2, 0.03)).at(middle, 0.101, z_0 - 0.04))
    yield "Window Frames", join(frames)
    yield "Pillar", box("Wall", (0.4, 0.4, HEIGHT + 0.01), bottom=False).at(7.9, 2.9)
    yield "Carpet", box("Carpet", (2.8, 2.6, 0.015), bottom=False).at(*TABLE)
    yield "Housings", join([furniture.lamp_housing().at(*at, HEIGHT) for at in PANELS])


def _some(places: tuple, detail: float) -> tuple:
    return places[: max(1, round(len(places) * min(detail, 1.0)))]


def _add_lamps(scene: bpy.types.Scene, detail: float) -> None:
    for number, (x, y) in enumerate(PANELS):
        lamp = bpy.data.lights.new("Panel", "AREA")
        lamp.shape, lamp.size, lamp.size_y = "RECTANGLE", 1.2, 0.28
        lamp.energy, lamp.color = PANEL_POWER, (1.0, 0.9, 0.76)
        add(scene, f"Panel {number}", lamp, (x, y, HEIGHT - 0.061))
    for number, (x, y) in enumerate(_some(DESKS, detail)):
        if number % 2 == 0:
            lamp = bpy.data.lights.new("Desk Lamp", "POINT")
            lamp.energy, lamp.shadow_soft_size, lamp.color = DESK_LAMP_POWER, 0.03, (1.0, 0.8, 0.55)
            turn = np.radians(LAMP_TURN)
            head = (x - 0.7 + 0.3 * np.cos(turn), y + 0.25 + 0.3 * np.sin(turn), 0.74 + 0.45)
            add(scene, f"Bulb {number}", lamp, head)


def _add_ceiling_lamps(scene: bpy.types.Scene, count: int) -> None:
    """Hang bulbs and small squares in turn, evenly spread."""
    power = len(PANELS) * PANEL_POWER + 3 * DESK_LAMP_POWER
    for number in range(count):
        lamp = bpy.data.lights.new("Lamp", "POINT" if number % 2 else "AREA")
        if number % 2:
            lamp.shadow_soft_size = 0.03
        else:
            lamp.shape, lamp.size = "SQUARE", 0.1
        lamp.energy, lamp.color = power / count, (1.0, 0.9, 0.76)
        x, y = (_radical_inverse(number + 1, base) for base in (2, 3))
        place = 0.3 + x * (WIDTH - 0.6), 0.3 + y * (DEPTH - 0.6), HEIGHT - 0.15
        add(scene, f"Lamp {number}", lamp, place)


def _radical_inverse(number: int, base: int) -> float:
    """Return the digits of a number mirrored at the point: evenly spread in [0, 1)."""
    value, step = 0.0, 1.0 / base
    while number:
        number, digit = divmod(number, base)
        value += step * digit
        step /= base
    return value


def _add_camera(scene: bpy.types.Scene) -> None:
    camera = bpy.data.cameras.new("Camera")
    camera.lens = 19.0
    obj = add(scene, "Camera", camera, (0.35, 6.75, 1.75))
    obj.rotation_euler = (np.radians(80), 0.0, np.radians(-127))
    scene.camera = obj
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    scene.view_settings.exposure = -1.0
    scene.render.resolution_x, scene.render.resolution_y = 960, 600
