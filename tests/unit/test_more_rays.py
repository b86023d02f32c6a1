"""Texels lit to a target error: what was traced stays, points and cells go on from there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake import pipeline
from radiosity_addon.bake.layout import lay_out
from radiosity_addon.bake.pipeline import bake, bake_and_keep
from radiosity_addon.bake.relight import relight_pages
from radiosity_addon.base import SILENT
from radiosity_addon.lightmap.lighting import reconstruction
from radiosity_addon.lightmap.lighting.reconstruction import light_texels
from radiosity_addon.lightmap.transport import GatherSettings, HitTable, TexelTransport, more_rays
from radiosity_addon.lightmap.transport.gather_points import STARTS, gather_at
from radiosity_addon.lightmap.transport.ray_runs import RUNS
from radiosity_addon.numerics import Scratch
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.solver import SolverSettings, solve
from tests.relit_rooms import lit_bake

FACTOR = 2.5


class Watched:
    """What goes into `with_more_rays` and comes out of it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.before: list[tuple] = []
        self.after: list[tuple] = []
        monkeypatch.setattr(reconstruction, "with_more_rays", self)

    def __call__(self, table: HitTable, transport: TexelTransport, layout, rows, *rest):
        copied = replace(transport.links, sources=rows.numbers(transport.links.sources))
        self.before.append((table, copied, layout))
        found = more_rays.with_more_rays(table, transport, layout, rows, *rest)
        links = found[0].links
        self.after.append((replace(links, sources=found[2].numbers(links.sources)), found[1], found[0].cells))
        return found


def test_what_was_traced_stays_and_sequences_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    watched = Watched(monkeypatch)
    room, settings = lit_bake(), BakeSettings(resolution=32)
    baked, scene = pipeline.baked_objects(room), room.scene
    atlas = lay_out(room, baked, settings, SILENT)
    geometry = pipeline.texels_of(room, baked, atlas, Scratch())
    local = solve(scene, SolverSettings(error=1e-3)).local_pass
    factors = iter([FACTOR, 1.0])
    gather = GatherSettings(strides=(2, 1), rays=32)
    light = light_texels(scene, local, geometry, gather, more_rays=lambda _: next(factors))
    ((table, old, before),), ((new, after, _),) = watched.before, watched.after
    # On the lattice of every second texel all points take twice as many runs as the others do in the mean.
    assert (np.bincount(before.texel[before.level == 0])[before.texel[before.level == 0]] == 2 * RUNS).all()
    finer = before.level == 1
    assert finer.sum() == pytest.approx(RUNS * (finer & (before.run == 0)).sum(), rel=0.1)
    assert before.runs(gather.times_rays) == pytest.approx(RUNS, rel=0.1)
    # As many times more rays, whole runs of each point one after the other.
    assert len(after.run) == pytest.approx(FACTOR * len(before.run), rel=0.01)
    first = np.flatnonzero(after.run == 0)
    count = np.diff(np.append(first, len(after.run)))
    np.testing.assert_array_equal(after.run, np.concatenate([np.arange(n) for n in count]))
    assert len(np.unique(after.texel[first])) == len(first)
    # Old runs are where they were among the runs of their point.
    place = {pair: row for row, pair in enumerate(zip(after.texel.tolist(), after.run.tolist(), strict=True))}
    kept = [place[pair] for pair in zip(before.texel.tolist(), before.run.tolist(), strict=True)]
    np.testing.assert_array_equal(new.sources[kept], old.sources)
    # New ones are those that a point would have taken next.
    added = np.setdiff1d(np.arange(len(after.run)), kept)[::7]
    edge = table.crossings.crossed[after.texel[added]]
    assert edge.any()
    assert not edge.all()
    for rows, starts in ((added[~edge], STARTS), (added[edge], None)):
        run = after.run[rows].astype(np.int64)
        found = gather_at(local, geometry, after.texel[rows], starts, 16, table.number, run=run)
        np.testing.assert_array_equal(new.sources[rows], found.sources)
    # The texels still take a whole of weight.
    ones = new.spread(np.ones((len(new.sources), 1)))
    np.testing.assert_allclose(ones, 1.0, rtol=1e-5)
    assert light.error > 0


def test_cells_keep_their_rays_unless_many_more_meet_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cells of a box without a lightmap, and of texels at its foot."""
    watched = Watched(monkeypatch)
    settings = BakeSettings(resolution=48, relative_error=0.03)
    result = bake(lit_bake(), settings)
    assert 0.03 / 1.3 < result.solver["estimated_error"] <= 0.03
    (_, before, _), (_, _, cells) = watched.before[-1], watched.after[-1]
    assert len(watched.after[-1][0].sources) > len(before.sources)
    rows = np.concatenate([links.rows for links in cells.links])
    assert len(np.unique(rows)) == len(rows)


@pytest.mark.parametrize("error", [0.2, 0.1, 0.05, 0.02])
def test_the_estimate_ends_close_below_what_was_asked(error: float) -> None:
    """Unless the fewest rays are too many already."""
    found = bake(lit_bake(), BakeSettings(resolution=48, relative_error=error)).solver["estimated_error"]
    fewest = bake(lit_bake(), BakeSettings(resolution=48, relative_error=0.2)).solver["estimated_error"]
    assert min(error / 1.3, fewest) <= found <= error


def test_a_bake_to_an_error_can_be_relit() -> None:
    """As it was: the same light comes back."""
    settings = BakeSettings(resolution=48, relative_error=0.03)
    result, kept = bake_and_keep(lit_bake(), settings)
    (page,), (other,) = result.pages, relight_pages(kept, kept.strengths)
    np.testing.assert_allclose(other.pixels, page.pixels, rtol=2e-3, atol=1e-3 * page.pixels.mean())
