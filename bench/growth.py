"""How the cost of closed rooms grows with their triangles; ours alone."""

from __future__ import annotations

from typing import Any

from . import curves, processes
from .cases import ROOM_SIZES, SMALL_ROOM_SIZES
from .compare import Bench, say

FIT_FROM = 10_000
"""Exponents are fitted from this size on: below it, fixed costs are the larger part."""
MINUTES = 6.0
BAKE_RESOLUTION = 1024


def grow(bench: Bench) -> dict[str, Any]:
    """Solve rooms of growing size, and bake the largest."""
    sizes = SMALL_ROOM_SIZES if bench.small else ROOM_SIZES
    quality = "draft" if bench.small else "medium"
    rows = [_room(bench, triangles=triangles, quality=quality) for triangles in sizes]
    fit_from = sizes[0] if bench.small else FIT_FROM
    resolution = 64 if bench.small else BAKE_RESOLUTION
    largest = _room(bench, triangles=sizes[-1], quality=quality, resolution=resolution)
    return {
        "case": "rooms",
        "title": "Closed rooms",
        "quality": quality,
        "rooms": rows,
        "bake": {"resolution": resolution, **largest},
        "fitted_from": fit_from,
        "exponents": exponents(rows, fit_from),
        "quietness": bench.quietness(),
    }


def _room(bench: Bench, **job: Any) -> dict[str, Any]:
    what = f"rooms: {job['triangles']:,} triangles" + (", baked" if "resolution" in job else "")
    try:
        row = bench.run("room", MINUTES, **job)
    except processes.MeasurementError as failure:
        say(f"{what}: {failure}")
        return {"triangles": job["triangles"], "failed": str(failure)}
    say(f"{what}: {row['seconds']:.1f} s, {row['links']:,} links, {row['memory_MB']:.0f} MB")
    return row


def exponents(rows: list[dict[str, Any]], smallest: int) -> dict[str, float]:
    """Return p of cost ∝ triangles^p for all that is counted; nothing if fewer than two sizes count."""
    done = [row for row in rows if "failed" not in row and row["triangles"] >= 0.95 * smallest]
    if len(done) < 2:
        return {}
    sizes = [row["triangles"] for row in done]
    names = ("seconds", "cpu_seconds", "links", "leaves", "memory_MB")
    return {name: curves.growth_exponent(sizes, [row[name] for row in done]) for name in names}
