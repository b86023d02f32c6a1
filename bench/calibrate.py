"""The effect of each setting on the error: data for choosing settings by a target error."""

from __future__ import annotations

from typing import Any

from .cases import Case
from .compare import Bench, our_bake, prepare

BEST: dict[str, dict[str, Any]] = {
    "solver": {"error": 3e-5, "shadow_rays": 16},
    "gather": {"support": 6.0, "rays": 1024, "sweeps": 128},
}
"""All knobs at once; each series worsens one of them, so that its own share of the error shows."""

SERIES: dict[str, tuple[str, str, tuple[float, ...]]] = {
    "links": ("solver", "error", (1e-4, 3e-4, 1e-3, 3e-3)),
    "shadow rays": ("solver", "shadow_rays", (8, 4, 2)),
    "gather rays": ("gather", "rays", (512, 256, 128, 64)),
    "gather density": ("gather", "support", (2.0, 1.0, 0.25)),
}


def calibrate(bench: Bench, case: Case) -> dict[str, Any]:
    """Bake a case with all knobs at their best, and with each of them worse alone."""
    prepared = prepare(bench, case)
    bakes = prepared.folder / "bakes"
    bakes.mkdir(exist_ok=True)

    def bake(part: str | None, name: str, value: float) -> dict[str, Any]:
        changed = {kind: {**knobs, **({name: value} if kind == part else {})} for kind, knobs in BEST.items()}
        entry = our_bake(bench, prepared, {"quality": "high", **changed}, bakes / "calibration.npy")
        kept = ("seconds", "cpu_seconds", "error", "mean_ratio", "uncertainty", "links", "leaves", "rays",
                "memory_MB", "estimated_error", "failed")  # fmt: skip
        return {"value": value, **{key: entry[key] for key in kept if key in entry}}

    best = bake(None, "", 0.0)
    series = {
        title: [{**best, "value": BEST[part][name]}, *(bake(part, name, value) for value in values)]
        for title, (part, name, values) in SERIES.items()
    }
    return {"case": f"calibration-{case.name}", "title": case.title, "best": BEST, "series": series}
