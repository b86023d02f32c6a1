"""Homes lit through small windows: a living room under a sky image, an apartment under sun and sky.

All materials are matte, so that Cycles and a bake solve the same scene.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import bpy
import numpy as np

from . import furniture
from .blender_parts import COLORS, add, add_mesh, diffuse, even_sky, glowing
from .shapes import Shape, ball, box, cushion, grid, join, lathe, polygon, reveal, wall_with_holes

Hole = tuple[float, float, float, float]
"""x₀, z₀, x₁, z₁ on a wall, from its left end seen from inside the other way round; see `room`."""

HEIGHT = 2.7
REVEAL, PARTITION = 0.3, 0.1
"""Thickness of outer and inner walls [m]."""

LIVING = (0.0, 0.0, 7.0, 5.0)
LIVING_WINDOWS = ((1.0, 1.0, 2.2, 2.2), (4.4, 1.0, 5.6, 2.2))
"""4.4 % of the walls."""

ROOMS = ((0.0, 0.0, 5.95, 4.45), (6.05, 0.0, 10.0, 4.45), (0.0, 4.55, 5.95, 8.0), (6.05, 4.55, 10.0, 8.0))
DOOR = 0.9, 2.05

SUN, SUN_TURN = 12.0, (0.85, 0.0, 0.35)
SKY = (1.6, 2.3, 3.6)
"""Radiance [W/m²/sr]."""


def build_living_room(detail: float = 1.0) -> bpy.types.Scene:
    """Fill the empty open file with a room of 150,000 triangles; a lower `detail` makes them fewer."""
    scene = _build("Living Room", _living_room(detail))
    _add_sky_image(scene)
    return scene


def build_apartment(detail: float = 1.0) -> bpy.types.Scene:
    """Fill the empty open file with four rooms of 190,000 triangles; a lower `detail` makes them fewer."""
    scene = _build("Apartment", _apartment(detail))
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle = SUN, 0.009
    add(scene, "Sun", sun, (0.0, 0.0, 5.0)).rotation_euler = SUN_TURN
    even_sky(scene, SKY)
    return scene


def room(area: Sequence[float], holes: dict[str, Sequence[Hole]], depth: dict[str, float]) -> Shape:
    """Return a room's walls seen from inside, with the sides of their holes.

    area: x₀, y₀, x₁, y₁.
    holes: Of the walls "south", "east", "north" and "west"; x counts counter-clockwise around the room.
    depth: How deep the holes of a wall are; `REVEAL` where it says nothing.
    """
    x_0, y_0, x_1, y_1 = area
    width, length = x_1 - x_0, y_1 - y_0
    walls = (("south", width, 0, (x_0, y_0)), ("east", length, 90, (x_1, y_0)),
             ("north", width, 180, (x_1, y_1)), ("west", length, 270, (x_0, y_1)))  # fmt: skip
    parts = []
    for side, extent, turn, start in walls:
        here = holes.get(side, ())
        sides = [reveal("Wall", hole, depth.get(side, REVEAL)) for hole in here]
        parts.append(join([wall_with_holes("Wall", extent, HEIGHT, here), *sides]).turned(turn).at(*start))
    return join(parts)


def _living_room(detail: float) -> Iterator[tuple[str, Shape]]:
    random = np.random.default_rng(11)
    around = max(8, 2 * round(32 * detail**0.5))
    x, y = LIVING[2:]
    yield from _floor_and_ceiling(x, y)
    yield "Walls", room(LIVING, {"south": LIVING_WINDOWS}, {})
    for number, window in enumerate(LIVING_WINDOWS):
        for side, at in enumerate((window[0] - 0.25, window[2] + 0.25)):
            yield f"Curtain {number}.{side}", _curtain(0.5, 2.3, around).at(at, 0.14, 0.1)
    yield "Sofa", furniture.sofa(around).turned(180).at(3.5, 4.4)
    for number, (at, turn) in enumerate((((1.2, 3.0), -70), ((5.9, 3.0), 70))):
        yield f"Armchair {number}", _armchair(around).turned(turn).at(*at)
    yield "Rug", _rug(2.8, 2.0, around).at(3.5, 2.6)
    yield "Table", furniture.round_table(2 * around).at(3.5, 2.6)
    yield "On Table", join([furniture.mug(around).at(3.3, 2.5, 0.73), _bowl(around).at(3.7, 2.7, 0.73)])
    for number in range(3):
        case = furniture.bookcase(random, 6).turned(-90).at(0.002, 1.2 + 1.05 * number)
        yield f"Bookcase {number}", case
    for number, at in enumerate(((6.5, 0.5), (6.5, 4.5), (0.5, 4.5))):
        yield f"Plant {number}", furniture.plant(random, max(4, round(110 * detail))).at(*at)
    for number in range(6):
        pillow = cushion("Red" if number % 2 else "Paper", (0.42, 0.16, 0.42), around, 0.5)
        yield f"Pillow {number}", pillow.turned(random.uniform(-20, 20)).at(2.9 + 0.22 * number, 4.25, 0.72)
    for number in range(8):
        vase = _vase(random, around).at(6.82, 1.3 + 0.33 * number, 0.93)
        yield f"Vase {number}", vase
    yield "Sideboard", box("Oak", (0.4, 3.0, 0.93), bottom=False).at(6.798, 2.5)
    yield "Pendant", furniture.pendant(2 * around).at(3.5, 2.6, HEIGHT)
    yield "Picture", furniture.picture(1.6, 1.0, "Blue Cloth").turned(180).at(3.5, y - 0.001, 1.3)
    yield "Door", furniture.door().turned(90).at(x - 0.001, 0.7)
    yield "Cornice", _cornice(LIVING)


def _apartment(detail: float) -> Iterator[tuple[str, Shape]]:
    random = np.random.default_rng(12)
    around = max(6, 2 * round(20 * detail**0.5))
    yield from _floor_and_ceiling(10.0, 8.0)
    width, height = DOOR
    south = ((0.9, 0.9, 2.3, 2.2), (3.6, 0.9, 5.0, 2.2))
    thin = PARTITION / 2
    # Doors: living to bedroom, living to kitchen, kitchen to bath; a wall counts from its other end in turn.
    holes: list[dict[str, Sequence[Hole]]] = [
        {"south": south, "east": ((3.0, 0, 3.0 + width, height),),
         "north": ((1.0, 0, 1.0 + width, height),)},
        {"south": ((1.2, 0.9, 2.6, 2.2),), "west": ((4.45 - 3.0 - width, 0, 4.45 - 3.0, height),)},
        {"north": ((2.0, 1.1, 3.2, 2.1),), "south": ((4.95 - width, 0, 4.95, height),),
         "east": ((1.5, 0, 1.5 + width, height),)},
        {"west": ((3.45 - 1.5 - width, 0, 3.45 - 1.5, height),)},
    ]  # fmt: skip
    inner = [("east", "north"), ("west",), ("south", "east"), ("west",)]
    for number, (area, here, sides) in enumerate(zip(ROOMS, holes, inner, strict=True)):
        yield f"Walls {number}", room(area, here, dict.fromkeys(sides, thin))
        yield f"Cornice {number}", _cornice(area)
    yield "Sofa", furniture.sofa(around).turned(-90).at(0.5, 2.3)
    yield "Table", furniture.round_table(2 * around).at(3.4, 2.4)
    for number, angle in enumerate((20, 110, 200, 290)):
        yield (
            f"Chair {number}",
            furniture.office_chair(around).turned(90).at(x=0.95).turned(angle).at(3.4, 2.4),
        )
    yield (
        "Bed",
        join([box("Oak", (1.6, 2.0, 0.3)), cushion("White", (1.6, 2.0, 0.3), around).at(z=0.42)]).at(
            8.9, 3.2
        ),
    )
    yield "Desk", furniture.desk().turned(180).at(7.2, 0.6)
    yield "Counter", box("White", (3.2, 0.6, 0.9), bottom=False).at(4.3, 7.698)
    yield "Bath", box("White", (1.6, 0.7, 0.55), bottom=False).at(9.1, 7.6)
    for number, (at, turn) in enumerate(
        (((0.002, 0.9), -90), ((5.94, 1.0), 90), ((6.052, 2.2), -90), ((9.998, 1.4), 90))
    ):
        yield f"Bookcase {number}", furniture.bookcase(random, 5).turned(turn).at(*at)
    for number, at in enumerate(((5.4, 0.5), (9.5, 0.5), (0.5, 7.5))):
        yield f"Plant {number}", furniture.plant(random, max(4, round(70 * detail))).at(*at)
    yield from _things(random, max(6, 2 * around // 3), max(20, round(420 * detail)))


def _things(random: np.random.Generator, around: int, count: int) -> Iterator[tuple[str, Shape]]:
    """Yield small objects that stand about on tables, the counter, the sill and the floor."""
    areas = ((2.95, 1.95, 3.85, 2.85, 0.73), (2.8, 7.45, 5.8, 7.9, 0.9), (6.5, 0.3, 7.9, 0.9, 0.74),
             (0.3, 3.2, 2.5, 4.2, 0.0), (6.4, 1.2, 7.6, 4.0, 0.0), (0.4, 5.0, 3.5, 6.8, 0.0),
             (6.6, 5.0, 8.2, 7.2, 0.0))  # fmt: skip
    # Cells of 12 cm: nothing stands in another.
    cells = [(x, y, z) for x_0, y_0, x_1, y_1, z in areas
             for x in np.arange(x_0 + 0.06, x_1, 0.14) for y in np.arange(y_0 + 0.06, y_1, 0.14)]  # fmt: skip
    for number, cell in enumerate(random.permutation(np.array(cells))[:count]):
        kind = number % 5
        paint = ("Red", "Yellow", "Clay", "White", "Blue Cloth", "Paper")[random.integers(6)]
        if kind == 0:
            thing = _vase(random, around, 0.35)
        elif kind == 1:
            thing = furniture.mug(around)
        elif kind == 2:
            thing = ball(paint, 0.045, around).at(z=0.0455)
        elif kind == 3:
            thing = box(paint, (0.08, 0.1, random.uniform(0.02, 0.12)), bottom=False)
        else:
            thing = cushion(paint, (0.1, 0.08, 0.07), around, 0.4).at(z=0.0355)
        yield f"Thing {number}", thing.turned(random.uniform(0, 360)).at(*cell[:2], cell[2] + 0.0005)


def _floor_and_ceiling(x: float, y: float) -> Iterator[tuple[str, Shape]]:
    z, out = HEIGHT, REVEAL
    yield (
        "Floor",
        polygon("Floor", (-out, -out, 0), (x + out, -out, 0), (x + out, y + out, 0), (-out, y + out, 0)),
    )
    yield (
        "Ceiling",
        polygon("Ceiling", (-out, -out, z), (-out, y + out, z), (x + out, y + out, z), (x + out, -out, z)),
    )


def _curtain(width: float, height: float, around: int) -> Shape:
    """Return a hanging sheet in waves about x = 0, seen from +y and from -y."""
    across = np.linspace(-0.5, 0.5, 2 * around + 1)
    up = np.linspace(0.0, 1.0, around // 2 + 1)
    wave = 0.05 * np.sin(across[:, None] * 40) * (1.2 - 0.4 * up)
    points = np.stack(
        [
            np.broadcast_to(width * across[:, None], wave.shape),
            wave,
            np.broadcast_to(height * up, wave.shape),
        ],
        axis=2,
    )
    return grid("Paper", points[::-1])


def _rug(width: float, length: float, around: int) -> Shape:
    """Return an uneven sheet a centimeter above the floor."""
    x, y = np.linspace(-0.5, 0.5, around + 1), np.linspace(-0.5, 0.5, around + 1)
    bumps = 0.012 + 0.004 * np.sin(60 * x[:, None]) * np.sin(50 * y)
    shape = bumps.shape
    places = [np.broadcast_to(width * x[:, None], shape), np.broadcast_to(length * y, shape), bumps]
    return grid("Carpet", np.stack(places, axis=2))


def _armchair(around: int) -> Shape:
    """Return a soft chair that faces +y."""
    parts = [cushion("Blue Cloth", (0.7, 0.75, 0.32), around).at(z=0.3)]
    parts += [cushion("Blue Cloth", (0.18, 0.75, 0.5), around).at(x, 0, 0.4) for x in (-0.42, 0.42)]
    return join([*parts, cushion("Blue Cloth", (0.7, 0.2, 0.7), around).turned(-10, 0).at(0, -0.35, 0.65)])


def _bowl(around: int) -> Shape:
    return lathe("Clay", [(0.05, 0), (0.14, 0.07), (0.135, 0.07), (0.045, 0.01), (0, 0.01)], around)


def _vase(random: np.random.Generator, around: int, size: float = 1.0) -> Shape:
    """Return a closed turned body, at most 12 cm wide and 33 cm high at size 1."""
    z = np.linspace(0, 1, max(4, around // 3))
    radius = 0.1 * (0.55 + 0.4 * np.sin(np.pi * z * random.uniform(0.7, 1.3)))
    height = random.uniform(0.2, 0.33)
    profile = [*zip(size * radius, size * height * z, strict=True), (0.0, size * height)]
    return lathe(("Clay", "White", "Blue Cloth")[random.integers(3)], profile, around)


def _cornice(area: Sequence[float]) -> Shape:
    """Return strips of 6 cm along the top of a room's walls."""
    x_0, y_0, x_1, y_1 = area
    size, z = 0.06, HEIGHT - 0.0605
    along_x = box("White", (x_1 - x_0 - 0.002, size, 0.06))
    along_y = box("White", (size, y_1 - y_0 - 2 * size - 0.004, 0.06))
    inset, middle = size / 2 + 0.001, ((x_0 + x_1) / 2, (y_0 + y_1) / 2)
    strips = [along_x.at(middle[0], y, z) for y in (y_0 + inset, y_1 - inset)]
    return join([*strips, *(along_y.at(x, middle[1], z) for x in (x_0 + inset, x_1 - inset))])


def _build(name: str, pieces: Iterable[tuple[str, Shape]]) -> bpy.types.Scene:
    scene = bpy.context.scene
    scene.name = name
    materials = {paint: diffuse(paint, color) for paint, color in COLORS.items()} | {
        "Bulb": glowing("Bulb", 20.0)
    }
    for title, shape in pieces:
        add_mesh(scene, title, shape, materials)
    camera = bpy.data.cameras.new("Camera")
    camera.lens = 19.0
    obj = add(scene, "Camera", camera, (0.7, 0.7, 1.6))
    obj.rotation_euler = (np.radians(82), 0.0, np.radians(-50))
    scene.camera = obj
    return scene


def _add_sky_image(scene: bpy.types.Scene) -> None:
    """Light a scene by an image of 512 × 256: bright sky with clouds and a hazy sun, dark ground."""
    random = np.random.default_rng(5)
    elevation = np.radians(np.linspace(-90, 90, 256))[:, None, None]
    azimuth = np.radians(np.linspace(-180, 180, 512, endpoint=False))[None, :, None]
    clouds = np.zeros((256, 512, 1))
    for octave in range(2, 6):
        coarse = random.uniform(0, 1, (2**octave, 2 ** (octave + 1), 1))
        clouds += np.kron(coarse, np.ones((256 >> octave, 256 >> octave, 1))) / 2**octave
    blue = np.array((0.9, 1.5, 2.8)) * (1.3 - 0.5 * np.sin(np.maximum(elevation, 0)))
    sky = blue + np.array((4.0, 4.0, 4.0)) * np.clip(clouds - 0.5, 0, 1)
    toward = np.sin(elevation) * np.sin(0.6) + np.cos(elevation) * np.cos(0.6) * np.cos(azimuth + 1.2)
    sky = sky + np.array((300.0, 260.0, 190.0)) * np.exp((toward - 1) / 0.002)
    pixels = np.where(elevation > 0, sky, np.array((0.25, 0.22, 0.18)))
    image = bpy.data.images.new("Sky", 512, 256, float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.append(pixels, np.ones((256, 512, 1)), axis=2).astype(np.float32).ravel())
    image.pack()
    even_sky(scene, (1.0, 1.0, 1.0))
    tree = scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(node.outputs["Color"], background.inputs["Color"])
