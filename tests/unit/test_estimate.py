"""What is reckoned of a bake beforehand, against bakes that were measured."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from radiosity_addon.bake.estimate import LightmappedObject as Item
from radiosity_addon.bake.estimate import estimate_bake
from radiosity_addon.bake.texel_memory import process_bytes
from radiosity_addon.options.bake_settings import BakeSettings

RESULTS = Path(__file__).resolve().parents[2] / "bench" / "results"

USUAL_SECONDS = {"cornell": (256, 13.4), "interior": (64, 25.0)}
"""Samples of Cycles, and the time they take on the cores that estimates are of [s]: other runs may have been
measured on a machine of half their speed."""

BOX = [
    Item(f"Part {number}", 2 if number < 5 else 10, area) for number, area in enumerate([5, 5, 5, 5, 5, 2, 3])
]
"""About the Cornell box: five walls and two blocks, 34 triangles with the lamp's."""

OFFICE = [Item(f"Thing {number}", 390, 4.0) for number in range(100)]
"""As many triangles as the office has, in a hundred objects."""


@pytest.mark.parametrize(
    ("case", "quality"),
    [(case, quality) for case in ("cornell", "interior") for quality in ("draft", "medium")]
    + [("cornell", "high")],
)
def test_texels_time_and_memory_are_of_the_right_size(case: str, quality: str) -> None:
    """Within a factor of 1.5 of what was measured, by Cycles' time in the same run; little memory of 2.2."""
    objects = BOX if case == "cornell" else OFFICE
    measured = json.loads((RESULTS / f"{case}.json").read_text())
    (bake,) = (entry for entry in measured["ours"] if entry["label"] == quality)
    cores = measured["context"]["machine"]["cores"]
    settings = BakeSettings(resolution=measured["resolution"], quality=quality, threads=cores)
    sources = 1 if case == "cornell" else 16
    plan = estimate_bake(objects, measured["triangles"], settings, sources=sources)
    samples, usual = USUAL_SECONDS[case]
    (cycles,) = (entry["seconds"] for entry in measured["cycles"] if entry["samples"] == samples)
    assert plan.seconds is not None
    # The process takes about 320 MB before it bakes.
    needed = 1e6 * max(bake["memory_MB"] - 320, 50)
    for found, expected, factor in (
        (sum(plan.texels), measured["texels"], 1.5),
        (plan.seconds, bake["seconds"] * usual / cycles, 1.5),
        (plan.memory - process_bytes(), needed, 2.2 if needed < 3e8 else 1.5),
    ):
        assert expected / factor < found < factor * expected


def test_a_million_triangles_are_of_the_right_size() -> None:
    """A closed room with a layout of twelve charts."""
    measured = json.loads((RESULTS / "rooms.json").read_text())
    bake, cores = measured["bake"], measured["context"]["machine"]["cores"]
    settings = BakeSettings(resolution=bake["resolution"], quality=measured["quality"], threads=cores)
    triangles = bake["triangles"]
    room = [Item("Room", triangles, 94.0, keeps_uvs=True)]
    plan = estimate_bake(room, triangles, settings, faces=triangles)
    assert plan.seconds == pytest.approx(bake["seconds"], rel=0.5)
    assert sum(plan.texels) == pytest.approx(bake["texels"], rel=0.3)


def test_pages_follow_a_density() -> None:
    coarse, fine = (estimate_bake(BOX, 34, BakeSettings(texel_density=density)) for density in (20.0, 80.0))
    assert len(coarse.pages) == len(fine.pages) == 1
    assert fine.pages[0] / coarse.pages[0] == pytest.approx(4.0, rel=0.1)
    assert sum(coarse.texels) == pytest.approx(30 * 20.0**2)


def test_what_does_not_fit_one_page_takes_more() -> None:
    plan = estimate_bake(BOX, 34, BakeSettings(texel_density=100.0, max_resolution=256))
    assert len(plan.pages) > 3
    assert max(plan.pages) <= 256


def test_each_object_has_its_own_page_on_request() -> None:
    plan = estimate_bake(BOX, 34, BakeSettings(atlas="per-object", resolution=64))
    assert plan.pages == (64,) * 7


def test_texel_scales_share_out_texels() -> None:
    one, other = estimate_bake([Item("A", 2, 4.0), Item("B", 2, 4.0, scale=2.0)], 4, BakeSettings()).texels
    assert other == pytest.approx(4 * one)


def test_wider_padding_leaves_fewer_texels() -> None:
    settings = [BakeSettings(mip_levels=levels) for levels in (0, 3)]
    plain, apart = (sum(estimate_bake(OFFICE, 39_000, each).texels) for each in settings)
    assert apart < plain
    assert apart > 0


def test_there_is_no_time_estimate_for_a_target_error() -> None:
    assert estimate_bake(BOX, 34, BakeSettings(relative_error=0.02)).seconds is None
    assert estimate_bake(BOX, 34, BakeSettings(method="jacobi")).seconds is None
