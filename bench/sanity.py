"""What must hold of any results, however coarse the bakes and however busy the machine."""

from __future__ import annotations

from typing import Any

import numpy as np

BAKES = ("ours", "cycles")
BIAS = 0.15
"""A bake's mean must not be farther off than this, relative to the references'."""


def complaints(results: dict[str, Any]) -> list[str]:
    """Return what is wrong with one case's results."""
    if "rooms" in results:
        return _rooms(results)
    wrong = []
    for who in (*BAKES, "cycles_oidn"):
        for entry in results[who]:
            name = f"{who} {entry.get('label', entry.get('samples'))}"
            if "failed" in entry:
                wrong.append(f"{name} failed: {entry['failed']}")
                continue
            figures = [entry[key] for key in ("seconds", "error", "mean_ratio", "memory_MB")]
            if not np.isfinite(figures).all() or min(entry["seconds"], entry["memory_MB"]) <= 0:
                wrong.append(f"{name} has a figure that is not finite and positive: {figures}")
            if who in BAKES and abs(entry["mean_ratio"] - 1) > BIAS + 3 * entry["uncertainty"]:
                wrong.append(f"{name} has a mean of {entry['mean_ratio']:.3f} of the references'")
    done = [entry for entry in results["cycles"] if "error" in entry]
    doubt = 3 * sum(entry["uncertainty"] for entry in done)
    if len(done) > 1 and done[-1]["error"] > done[0]["error"] + doubt:
        wrong.append("Cycles' error does not fall with samples")
    empty = [e for e in results["ours"] if "failed" not in e and min(e["links"], e["leaves"], e["rays"]) <= 0]
    return wrong + [f"ours {entry['label']} has no links, leaves or rays" for entry in empty]


def _rooms(results: dict[str, Any]) -> list[str]:
    wrong = []
    for row in [*results["rooms"], results["bake"]]:
        name = f"{row['triangles']:,} triangles"
        if "failed" in row:
            wrong.append(f"{name} failed: {row['failed']}")
        elif row["leaves"] < 1 or row["links"] < 1 or row["seconds"] <= 0:
            wrong.append(f"{name} has no leaves, links or time")
        elif abs(row["closure_area_mean"] - 1) > 0.05:
            wrong.append(
                f"{name}: what leaves a face of a closed room arrives {row['closure_area_mean']:.3f} times"
            )
    return wrong
