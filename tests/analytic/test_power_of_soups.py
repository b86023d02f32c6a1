"""No light from nothing, whatever the triangles: checked by a ray tracer of its own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.solver import Scene, SolverSettings, solve
from tests.analytic.soup_tracer import Soup, measure
from tests.rooms import CEILING, box_room, gray_scene, rectangle, solid_box
from tests.unit.texel_scenes import bake_scene

TOLERANCE = 0.005
"""Share of the emitted power that may be made or lost, beyond three standard errors."""

X, Y, Z = np.eye(3)


def joined(*parts: tuple[np.ndarray, float, float]) -> Soup:
    """Make a soup of (triangles, reflectance, emission)."""
    return Soup(
        np.concatenate([part[0] for part in parts]),
        np.concatenate([np.full(len(part[0]), part[1]) for part in parts]),
        np.concatenate([np.full(len(part[0]), part[2]) for part in parts]),
    )


def sheets(apart: float, count: int = 5, room: bool = False) -> Soup:
    """Glowing sheets over a floor, in one another."""
    sheet = rectangle((0.5, 0.5, 1.0), X, Y)
    layers = [(sheet + apart * number * Z, 0.5, 1.0) for number in range(count)]
    around = box_room((2, 2, 2))[0] if room else rectangle((0, 0, 0), 2 * X, 2 * Y)
    return joined((around, 0.5, 0.0), *layers)


def partial() -> Soup:
    """A large panel, smaller ones in it, one of them turned, and one that reaches beyond it."""
    turned = rectangle((0.9, 0.5, 1), (0.4, 0.3, 0), (-0.3, 0.4, 0))
    return joined(
        (rectangle((0, 0, 0), 2 * X, 2 * Y), 0.6, 0.0),
        (rectangle((0.4, 0.4, 1), 1.2 * Y, 1.2 * X), 0.3, 1.0),
        (turned, 0.3, 1.0),
        (rectangle((1.2, 1.2, 1), 0.8 * X, 0.6 * Y), 0.3, 1.0),
        (rectangle((0.5, 0.5, 1), 0.3 * X, 0.3 * Y, 3), 0.3, 1.0),
    )


def fan() -> Soup:
    """A fan that turns one and a half times around its middle."""
    angle = np.linspace(0.0, 3.0 * np.pi, 10)
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(10)], axis=1)
    blades = np.stack([np.zeros((9, 3)), rim[:-1], rim[1:]], axis=1)
    return joined((blades, 0.5, 1.0), (rectangle((-1.5, -1.5, -1), 3 * X, 3 * Y), 0.7, 0.0))


def layered_walls() -> Soup:
    """A closed room whose walls are there twice, cut up differently, with a lamp in it."""
    return joined(
        (box_room((2, 2, 2))[0], 0.7, 0.0),
        (box_room((2, 2, 2), n=3)[0], 0.7, 0.0),
        (rectangle((0.5, 0.5, 1.5), 0.5 * Y, 0.5 * X), 0.4, 3.0),
    )


def nested_boxes() -> Soup:
    """Boxes that share faces with each other and with the room they stand in."""
    return joined(
        (box_room((2, 2, 2))[0], 0.6, 0.0),
        (solid_box((0, 0, 0), (1, 1, 1)), 0.6, 0.0),
        (solid_box((0, 0, 0), (0.5, 0.5, 1.0)), 0.6, 0.0),
        (solid_box((1, 0, 0), (1.5, 1, 0.5)), 0.6, 0.0),
        (rectangle((0.6, 0.6, 1.9), 0.8 * Y, 0.8 * X), 0.5, 2.0),
    )


def crossing(seed: int = 3) -> Soup:
    """Triangles that run through each other, half of them glowing."""
    rng = np.random.default_rng(seed)
    triangles = rng.uniform(-1, 1, (12, 3, 3))
    return Soup(triangles, rng.uniform(0.2, 0.8, 12), np.where(np.arange(12) % 2, 1.0, 0.0))


def thin_slab() -> Soup:
    """A glowing slab of half a ray offset, over a floor."""
    slab = solid_box((0.5, 0.5, 1.0), (1.5, 1.5, 1.0 + 1e-5))
    return joined((rectangle((0, 0, 0), 2 * X, 2 * Y), 0.5, 0.0), (slab, 0.5, 1.0))


KINDS: dict[str, Callable[[], Soup]] = {
    "one sheet": lambda: sheets(0.0, 1),
    "sheets": lambda: sheets(0.0),
    "sheets, 1 um": lambda: sheets(1e-6),
    "sheets, 10 um": lambda: sheets(1e-5),
    "sheets in a room": lambda: sheets(1e-6, room=True),
    "partial": partial,
    "fan": fan,
    "layered walls": layered_walls,
    "nested boxes": nested_boxes,
    "crossing": crossing,
    "thin slab": thin_slab,
}


def check(soup: Soup, layer: float = 4e-5, error: float = 1e-3) -> None:
    count = len(soup.triangles)
    channels = np.ones((1, 3))
    scene = Scene(
        soup.triangles,
        soup.reflectance[:, None] * channels,
        soup.emission[:, None] * channels,
        two_sided=True,
    )
    assert count == len(scene)
    solution = solve(scene, SolverSettings(error=error))

    def irradiance(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        return np.asarray(solution.irradiance(points, normals)[:, 0])

    found = measure(soup, irradiance, layer)
    allowed = TOLERANCE * found.emitted + 3.0 * found.error
    assert abs(found.absorbed + found.escaped - found.emitted) <= allowed, f"{found} {found.excess}"
    power = solution.report["power_W"]
    assert power["emitted"] == pytest.approx(found.emitted, rel=0.03)
    assert power["absorbed"] + power["escaped"] == pytest.approx(power["emitted"], rel=0.01)


def rounded(soup: Soup, scale: float, away: float) -> Soup:
    """Return a soup that is scaled and far from the origin, as float32 has it."""
    triangles = (scale * soup.triangles + (away, -away, away)).astype(np.float32)
    return Soup(triangles.astype(np.float64), soup.reflectance, soup.emission)


@pytest.mark.parametrize(("away", "spacing"), [(1e3, 6.1e-5), (1e5, 7.8e-3)])
# One step lies between the two.
@pytest.mark.parametrize("steps", [0, pytest.param(1, marks=pytest.mark.full), 7])
def test_so_it_is_far_from_the_origin(away: float, spacing: float, steps: int) -> None:
    """Sheets that are up to 8 float32 spacings apart count once."""
    soup = rounded(sheets(steps * spacing / 10.0, room=True), 10.0, away)
    check(soup, layer=9.0 * spacing)


def test_lightmaps_absorb_what_glowing_panels_in_a_ceiling_send() -> None:
    """Five panels in a closed room's ceiling, 1 µm apart: by the texels of all that is baked."""
    room, surface = box_room((2, 2, 2))
    panel = rectangle((0.5, 0.5, 2.0), Y, X)
    panels = [panel - 1e-6 * number * Z for number in range(5)]
    triangles = np.concatenate([room[surface != CEILING], room[surface == CEILING], *panels])
    emission = np.zeros(len(triangles))
    emission[12:] = 1.0
    reflectance = 0.5
    scene = gray_scene(triangles, reflectance, emission[:, None] * np.ones(3), two_sided=True)
    parts = [("Walls", 10), ("Ceiling", 2), *((f"Panel {number}", 2) for number in range(5))]
    settings = BakeSettings(quality="medium", resolution=64, atlas="per-object", quantity="irradiance")
    result = bake(bake_scene(scene, *parts), settings)
    mean = {
        item.object.name: float(page.pixels[page.coverage][:, 0].mean())
        for item, page in zip(result.objects, result.pages, strict=True)
    }
    # The panels cover a quarter of the ceiling. What is under them is lit as if alone, like the rest of it.
    arriving = mean["Walls"] * 5 * 4.0 + mean["Ceiling"] * 3.0 + mean["Panel 4"] * 1.0
    assert (1.0 - reflectance) * arriving == pytest.approx(1.0, rel=TOLERANCE)
    # The uppermost panel is in the ceiling's plane and shines upwards as well.
    assert result.solver["power_W"]["emitted"] == pytest.approx(2.0)


@pytest.mark.parametrize("kind", KINDS)
def test_light_is_neither_made_nor_lost(kind: str) -> None:
    # Elements that others run through lose light until they are small.
    check(KINDS[kind](), error=2e-4 if kind == "crossing" else 1e-3)
