"""The quality sketch: what it saves that draft does not."""

from __future__ import annotations

import pytest

from radiosity_addon.bake.pipeline import bake_and_keep
from radiosity_addon.options import BakeSettings
from tests.relit_rooms import lit_bake


@pytest.fixture(scope="module")
def kept() -> dict[str, tuple[float, int, int]]:
    """By quality, the mean of the lightmap, gather rays, and the most rays of a cell."""
    found = {}
    for quality in ("sketch", "draft"):
        result, bake = bake_and_keep(lit_bake(), BakeSettings(resolution=32, quality=quality))
        transport = bake.lit.transport
        page = result.pages[0]
        mean = float(page.pixels[page.coverage].mean())
        most = max(links.sources.shape[1] for links in transport.cells.links)
        found[quality] = mean, transport.links.sources.size, most
    return found


def test_a_sketch_has_the_light_of_a_draft(kept: dict[str, tuple[float, int, int]]) -> None:
    assert kept["sketch"][0] == pytest.approx(kept["draft"][0], rel=0.02)


def test_a_sketch_traces_less_than_half_the_gather_rays(kept: dict[str, tuple[float, int, int]]) -> None:
    assert kept["sketch"][1] < 0.5 * kept["draft"][1]


def test_cells_of_a_sketch_gather_with_no_more_than_four_rays(
    kept: dict[str, tuple[float, int, int]],
) -> None:
    assert kept["sketch"][2] == 4
    assert kept["draft"][2] > 4
