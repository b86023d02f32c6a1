"""A room as two bakes and a path tracer show it: `python3 -m bench.views --case living-room`.

From left to right: our bake, Cycles' bake with Open Image Denoise in the same processor time, and a picture
that Cycles traced. How many samples take as long follows from the case's results; both bakes are made anew.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from . import pictures
from .__main__ import DEFAULT_CACHE, ROOT
from .cases import CASES
from .compare import Bench, Prepared, cycles_bake, denoise, our_bake, prepare, say

RESULTS = ROOT / "bench" / "results"


def draw_views(bench: Bench, name: str, quality: str) -> Path:
    """Bake a case both ways, and write the strip of pictures; return its path.

    Raises
    ------
    FileNotFoundError
        If the case has no results that tell how many samples take as long.
    """
    prepared = prepare(bench, CASES[name])
    samples = samples_as_long(json.loads((RESULTS / f"{name}.json").read_text()), quality)
    folder = prepared.folder / "views"
    folder.mkdir(exist_ok=True)
    ours = our_bake(bench, prepared, {"quality": quality}, folder / "ours.npy")
    noisy = cycles_bake(bench, prepared, samples, folder / "cycles.npy")
    denoised = denoise(bench, prepared, noisy, folder / "cycles.npy")
    with np.load(folder / f"oidn-{samples}.npz") as pages:
        np.save(folder / "denoised.npy", pages[denoised["filter"]])
    seconds = [entry["cpu_seconds"] for entry in (ours, denoised)]
    say(f"{name}: {seconds[0]:.0f} s of ours, {seconds[1]:.0f} s of Cycles, {samples} samples")
    shown = [_seen(bench, prepared, folder, lightmap) for lightmap in ("ours.npy", "denoised.npy", None)]
    target = bench.output / f"{name}-view.jpg"
    pictures.draw_strip(shown, target)
    return target


def samples_as_long(results: dict[str, Any], quality: str) -> int:
    """Return the samples with which Cycles and the denoiser take our processor time at a quality."""
    ours = next(entry["cpu_seconds"] for entry in results["ours"] if entry["label"] == quality)
    measured = [(entry["samples"], entry["cpu_seconds"]) for entry in results["cycles_oidn"]]
    slope, fixed = np.polyfit(*zip(*measured, strict=True), 1)
    return max(1, round((ours - fixed) / slope))


def _seen(bench: Bench, prepared: Prepared, folder: Path, lightmap: str | None) -> Path:
    """Return the picture of a lightmap, or of the scene itself."""
    target = folder / f"{Path(lightmap).stem if lightmap else 'traced'}.png"
    mean = float(prepared.mean[prepared.compared].mean())
    job = {"case": prepared.case.name, "folder": prepared.folder, "mean": mean, "picture": target}
    bench.run("view", 60, **job, lightmap=folder / lightmap if lightmap else None)
    return target


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", required=True, choices=sorted(CASES))
    parser.add_argument("--quality", default="draft")
    parser.add_argument("--output", type=Path, default=RESULTS)
    chosen = parser.parse_args()
    bench = Bench(DEFAULT_CACHE, chosen.output, small=False, threads=os.cpu_count() or 1)
    say(f"wrote {draw_views(bench, chosen.case, chosen.quality)}")


if __name__ == "__main__":
    main()
