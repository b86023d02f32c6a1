"""Objects that reach far beyond the others leave them texels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake import LightmappedObject, estimate_bake, thinned_out
from radiosity_addon.bake.importance import (
    LEAST_SCALE,
    LEAST_SHARE,
    LEAST_SHARE_OF_FEW,
    Extent,
    justified_scales,
)
from radiosity_addon.options import BakeSettings


def extent(low: tuple[float, ...], high: tuple[float, ...], surface: float, free: bool = True) -> Extent:
    return Extent(np.array([low, high], dtype=float), surface, free)


HOUSE = [extent((-4, -6, 0), (4, 6, 3), 400.0), *[extent((-2, -2, 0), (2, 2, 1), 100.0)] * 7]


def disc(free: bool = True) -> Extent:
    return extent((-50, -50, 0), (50, 50, 0), 20_000.0, free)


def test_a_ground_around_a_house_takes_what_lies_among_the_others() -> None:
    *house, ground = justified_scales([*HOUSE, disc()])
    assert house == [1.0] * 8
    diagonal = np.sqrt(8**2 + 12**2 + 3**2)
    part = (8 + 0.5 * diagonal) * (12 + 0.5 * diagonal) / 100**2
    assert ground == pytest.approx(np.sqrt(part))


def test_it_keeps_a_share_however_far_it_reaches() -> None:
    far = extent((-1e4, -1e4, 0), (1e4, 1e4, 0), 4e8)
    assert justified_scales([*HOUSE, far])[-1] == LEAST_SCALE
    town = [replace(part, surface=1e7) for part in HOUSE]
    scale = justified_scales([*town, far])[-1]
    assert scale**2 * 4e8 / (scale**2 * 4e8 + 8e7) == pytest.approx(LEAST_SHARE)


def test_a_room_encloses_what_is_in_it() -> None:
    hall = extent((-15, -10, 0), (15, 10, 8), 2000.0)
    assert justified_scales([*[extent((0, 0, 0), (0.5, 0.5, 1), 2.0)] * 9, hall]) == [1.0] * 10


def test_a_pebble_on_a_floor_is_no_scene() -> None:
    floor = extent((-1, -1, 0), (1, 1, 0), 4.0)
    assert justified_scales([extent((0, 0, 0.5), (0.02, 0.02, 0.5), 4e-4), floor]) == [1.0, 1.0]


JOINED = Extent(np.array([[-4.0, -6, 0], [4, 6, 6]]), 600.0, True, triangles=5_000)
PLANE = Extent(np.array([[-100.0, -100, 0], [100, 100, 0]]), 40_000.0, True, triangles=2)


def test_a_ground_around_a_house_in_one_piece_leaves_it_half_of_the_page() -> None:
    house, ground = justified_scales([JOINED, PLANE])
    assert house == 1.0
    taken = ground**2 * PLANE.surface
    assert taken / (taken + JOINED.surface) == pytest.approx(
        max(LEAST_SHARE_OF_FEW, LEAST_SCALE**2 / (LEAST_SCALE**2 + JOINED.surface / PLANE.surface))
    )


@pytest.mark.parametrize(
    ("house", "ground"),
    [
        (replace(JOINED, triangles=12), PLANE),
        (JOINED, replace(PLANE, triangles=101)),
        (replace(JOINED, surface=10_000.0), PLANE),
        (JOINED, replace(PLANE, free=False)),
        (JOINED, replace(PLANE, box=PLANE.box + np.array([[0, 0, -1], [0, 0, 50]]))),
    ],
    ids=["no detail", "a landscape", "not nearly all", "chosen", "encloses it"],
)
def test_next_to_one_object_a_ground_stays(house: Extent, ground: Extent) -> None:
    assert justified_scales([house, ground]) == [1.0, 1.0]


def test_what_is_chosen_or_alone_or_not_the_most_stays() -> None:
    assert justified_scales([*HOUSE, disc(free=False)]) == [1.0] * 9
    assert justified_scales([disc()]) == [1.0]
    assert justified_scales([*HOUSE, extent((-110, -1, 0), (110, 1, 0), 440.0)]) == [1.0] * 9
    assert justified_scales([]) == []


def objects(ground_scale: float = 1.0) -> list[LightmappedObject]:
    of_house = [
        LightmappedObject(f"part {k}", 100, part.surface, box=part.box) for k, part in enumerate(HOUSE)
    ]
    return [*of_house, LightmappedObject("ground", 2, 20_000.0, ground_scale, disc().box)]


def test_the_estimate_knows_and_names_it() -> None:
    thinned = estimate_bake(objects(), 202, BakeSettings(resolution=512))
    assert thinned.thinned[:8] == (1.0,) * 8
    assert thinned.densities[0] > 4.0 * thinned.densities[8]
    (warning,) = thinned_out([item.name for item in objects()], thinned.thinned, thinned.texels)
    assert warning.name == "ground"
    assert f"{thinned.thinned[8]:.2g}" in warning.message
    assert f"{thinned.texels[8] / sum(thinned.texels):.0%}" in warning.message


@pytest.mark.parametrize("given", [{"texel_density": 10.0}, {"atlas": "per-object"}])
def test_a_density_or_pages_of_their_own_overrule_it(given: dict[str, object]) -> None:
    assert estimate_bake(objects(), 202, BakeSettings(**given)).thinned == (1.0,) * 9  # type: ignore[arg-type]


def test_a_texel_scale_overrules_it() -> None:
    assert estimate_bake(objects(0.5), 202, BakeSettings()).thinned == (1.0,) * 9
