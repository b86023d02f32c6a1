"""The office's furniture, each piece standing on z = 0 about the origin unless said otherwise."""

from __future__ import annotations

import numpy as np

from .shapes import Shape, ball, box, cushion, cylinder, grid, join, lathe, polygon, rod


def desk() -> Shape:
    """Return a desk of 1.6 m × 0.8 m; who sits there looks toward +y."""
    top = box("Oak", (1.6, 0.8, 0.03)).at(z=0.71)
    legs = [cylinder("Steel", 0.025, 0.71, 12).at(x, y) for x in (-0.74, 0.74) for y in (-0.34, 0.34)]
    drawers = [box("White", (0.42, 0.6, 0.56), bottom=False).at(0.48, 0.02)]
    drawers += [box("Paper", (0.38, 0.02, 0.16)).at(0.48, -0.29, z) for z in (0.02, 0.2, 0.38)]
    drawers += [rod("Steel", (0.4, -0.32, z), (0.56, -0.32, z), 0.008, 8) for z in (0.12, 0.3, 0.48)]
    panel = box("Oak", (1.36, 0.02, 0.4)).at(0, 0.34, 0.3)
    return join([top, panel, *legs, *drawers])


def office_chair(around: int) -> Shape:
    """Return a chair on casters that faces +y."""
    thin = max(4, around // 3)
    seat = cushion("Blue Cloth", (0.5, 0.5, 0.1), around).at(z=0.48)
    back = cushion("Blue Cloth", (0.46, 0.08, 0.56), around)
    bent = back.vertices.copy()
    bent[:, 1] -= 0.9 * bent[:, 0] ** 2
    back = Shape(bent, back.faces, back.paint).turned(8, axis=0).at(0, -0.2, 0.86)
    spine = rod("Black", (0, -0.24, 0.46), (0, -0.27, 0.72), 0.02, thin)
    column = cylinder("Steel", 0.03, 0.36, around // 2).at(z=0.08)
    arms = [rod("Black", (x, -0.15, 0.68), (x, 0.15, 0.68), 0.02, thin) for x in (-0.28, 0.28)]
    arms += [rod("Black", (x, 0, 0.46), (x * 1.12, 0, 0.68), 0.014, thin) for x in (-0.25, 0.25)]
    feet = []
    for angle in range(0, 360, 72):
        feet.append(rod("Black", (0, 0, 0.1), (0.28, 0, 0.07), 0.02, thin).turned(angle))
        feet.append(ball("Black", 0.03, 2 * max(2, 5 * around // 24)).at(0.28, 0, 0.032).turned(angle))
    return join([seat, back, spine, column, *arms, *feet])


def monitor() -> Shape:
    """Return a screen that shines toward −y."""
    frame = box("Black", (0.6, 0.03, 0.36)).at(0, 0, 0.12)
    screen = polygon(
        "Screen", (-0.28, -0.016, 0.14), (0.28, -0.016, 0.14), (0.28, -0.016, 0.46), (-0.28, -0.016, 0.46)
    )
    foot = box("Black", (0.24, 0.18, 0.015), bottom=False).at(0, 0.03)
    neck = box("Black", (0.06, 0.03, 0.3)).at(0, 0.03)
    return join([frame, screen, foot, neck])


def keyboard(around: int) -> Shape:
    return cushion("Black", (0.44, 0.15, 0.024), around, 0.2).at(z=0.014)


def mug(around: int) -> Shape:
    """Return a mug, hollow."""
    return lathe("White", [(0.04, 0), (0.042, 0.1), (0.037, 0.1), (0.035, 0.01), (0, 0.01)], around)


def desk_lamp(around: int) -> Shape:
    """Return a lamp whose open shade hangs at (0.3, 0, 0.42)."""
    base = cylinder("Black", 0.09, 0.02, around)
    arm = [rod("Steel", (0, 0, 0.02), (-0.06, 0, 0.36), 0.01, 8)]
    arm.append(rod("Steel", (-0.06, 0, 0.36), (0.27, 0, 0.5), 0.01, 8))
    outside = [(0.1, 0.0), (0.09, 0.04), (0.05, 0.1), (0.025, 0.12), (0.0, 0.12)]
    return join([base, *arm, lathe("Red", outside, around).at(0.3, 0, 0.4)])


def pendant(around: int) -> Shape:
    """Return a lamp that hangs from the origin: a cord, an open shade, and a glowing ball in it."""
    outside = [(0.26, 0.0), (0.25, 0.05), (0.16, 0.16), (0.06, 0.22), (0.03, 0.26), (0.0, 0.26)]
    shade = lathe("Yellow", outside, around).at(z=-1.3)
    return join(
        [shade, rod("Black", (0, 0, -1.05), (0, 0, 0.01), 0.006, 8), ball("Bulb", 0.06, 12).at(z=-1.2)]
    )


def bookcase(random: np.random.Generator, shelves: int = 5) -> Shape:
    """Return shelves with books, 1 m wide, 2 m high, open toward +y, its back at y = 0."""
    width, depth, height = 1.0, 0.32, 2.0
    side = [box("Oak", (0.025, depth, height), bottom=False).at(x, depth / 2) for x in (-0.4875, 0.4875)]
    back = [box("Oak", (width, 0.015, height), bottom=False).at(0, 0.0075)]
    levels, books = np.linspace(0.05, height - 0.03, shelves + 1), []
    boards = [box("Oak", (0.95, depth - 0.02, 0.025)).at(0, depth / 2, z) for z in levels]
    colors = ("Red", "Blue Cloth", "Green", "Paper", "Yellow", "Black")
    for z in levels[:-1]:
        x = -0.46
        while x < random.uniform(0.1, 0.4):
            thickness = random.uniform(0.025, 0.07)
            size = (thickness - 0.002, random.uniform(0.17, 0.24), random.uniform(0.2, 0.31))
            color = colors[random.integers(len(colors))]
            books.append(box(color, size, bottom=False).at(x + thickness / 2, size[1] / 2 + 0.03, z + 0.025))
            x += thickness
    return join([*side, *back, *boards, *books])


def plant(random: np.random.Generator, leaves: int) -> Shape:
    """Return a pot with earth and bent leaves, up to 1.4 m high."""
    pot = lathe("Clay", [(0.15, 0), (0.2, 0.35), (0.18, 0.35), (0.175, 0.3), (0, 0.3)], 24)
    parts = [pot]
    for number in range(leaves):
        length, width = random.uniform(0.5, 1.1), random.uniform(0.06, 0.11)
        lift = np.radians(random.uniform(35, 85))
        s = np.linspace(0, 1, 11)
        angle = lift - 1.6 * s**1.5
        step = length / 10
        along = np.concatenate([[0], np.cumsum(np.cos(angle[:-1]) * step)])
        up = np.concatenate([[0], np.cumsum(np.sin(angle[:-1]) * step)])
        half = width / 2 * np.sin(np.pi * (0.06 + 0.94 * s)) ** 0.7
        across = np.array([-1.0, 0.0, 1.0])
        points = np.stack(
            [
                np.broadcast_to(0.02 + along, (3, 11)),
                across[:, None] * half,
                0.31 + up + 0.25 * half * np.abs(across)[:, None],
            ],
            axis=2,
        )
        turn = number * 137.5 + random.uniform(-15, 15)
        parts.append(grid("Leaf", np.ascontiguousarray(points.transpose(1, 0, 2))).turned(turn))
    return join(parts)


def round_table(around: int) -> Shape:
    top = lathe("White", [(0, 0.7), (0.6, 0.7), (0.62, 0.715), (0.6, 0.73), (0, 0.73)], around)
    column = lathe("Steel", [(0.32, 0), (0.3, 0.02), (0.05, 0.05), (0.04, 0.7)], around)
    return join([top, column])


def sofa(around: int) -> Shape:
    """Return a sofa for two that faces +y."""
    parts = [box("Green", (1.6, 0.83, 0.3), bottom=False)]
    parts += [cushion("Green", (0.7, 0.72, 0.2), around).at(x, 0.06, 0.39) for x in (-0.36, 0.36)]
    parts += [
        cushion("Green", (0.7, 0.22, 0.5), around).turned(-12, 0).at(x, -0.3, 0.66) for x in (-0.36, 0.36)
    ]
    parts += [box("Green", (0.14, 0.85, 0.58), bottom=False).at(x) for x in (-0.79, 0.79)]
    return join(parts)


def radiator(fins: int) -> Shape:
    """Return a radiator 1.4 m long, its middle plane at y = 0."""
    step = 1.4 / fins
    parts = [box("White", (step * 0.6, 0.09, 0.5)).at((i + 0.5) * step - 0.7, 0, 0.12) for i in range(fins)]
    parts += [rod("White", (-0.72, 0, z), (0.72, 0, z), 0.02, 8) for z in (0.17, 0.57)]
    return join(parts)


def blind(slats: int, width: float) -> Shape:
    """Return a blind of tilted slats that hangs down from z = 0."""
    parts = [box("White", (width, 0.05, 0.04)).at(0, 0, -0.04)]
    parts += [
        box("Paper", (width, 0.045, 0.002)).turned(35, axis=0).at(0, 0, -0.07 - 0.045 * i)
        for i in range(slats)
    ]
    return join(parts)


def waste_bin(around: int) -> Shape:
    return lathe("Black", [(0.1, 0), (0.14, 0.32), (0.132, 0.32), (0.095, 0.01), (0, 0.01)], around)


def picture(width: float, height: float, color: str) -> Shape:
    """Return a framed picture in the plane y = 0 that looks toward +y."""
    frame = box("Black", (width, 0.03, height)).at(0, 0.016)
    x = width / 2 - 0.04
    inside = polygon(
        color, (x, 0.032, 0.04), (-x, 0.032, 0.04), (-x, 0.032, height - 0.04), (x, 0.032, height - 0.04)
    )
    return join([frame, inside])


def door() -> Shape:
    """Return a closed door with its frame in the plane y = 0, looking toward +y."""
    leaf = box("Oak", (0.9, 0.04, 2.0)).at(0, 0.02, 0.005)
    frame = [box("White", (0.08, 0.08, 2.08), bottom=False).at(x, 0.04) for x in (-0.49, 0.49)]
    frame.append(box("White", (0.9, 0.08, 0.075)).at(0, 0.04, 2.005))
    handle = [rod("Steel", (0.38, 0.04, 1.0), (0.38, 0.1, 1.0), 0.012, 8)]
    handle.append(rod("Steel", (0.39, 0.1, 1.0), (0.26, 0.1, 1.0), 0.01, 8))
    return join([leaf, *frame, *handle])


def lamp_housing() -> Shape:
    """Return the flat box below the ceiling (z = 0), let into it, that an area lamp shines from."""
    return box("White", (1.3, 0.36, 0.07)).at(z=-0.06)
