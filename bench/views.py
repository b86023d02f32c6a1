"""A room as two bakes and a path tracer show it: `python3 -m bench.views --case apartment`.

From left to right: our bake on our UVs, Cycles' bake with Open Image Denoise in the same processor time on
those of Smart UV Project, which suit it, and a picture that Cycles traced.
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
from .compare import SEED, Bench, Prepared, prepare, say

RESULTS = ROOT / "bench" / "results"

WITH_BOTH = sorted(name for name in CASES if f"{name}-smart" in CASES)
"""Cases that are laid out both ways."""


def draw_views(bench: Bench, name: str, quality: str) -> Path:
    """Bake a case both ways, and write the strip of pictures; return its path.

    Raises
    ------
    FileNotFoundError
        If the case has no results that tell how many samples take as long.
    """
    prepared, other = prepare(bench, CASES[name]), CASES[f"{name}-smart"]
    measured = json.loads((RESULTS / f"{name}.json").read_text())
    samples, theirs = samples_as_long(measured, quality), bench.cache / other.key()
    if not (theirs / "texels.npz").is_file():
        bench.run("prepare", 30, case=other.name, folder=theirs)
    made = prepared.folder / "views"
    made.mkdir(exist_ok=True)
    ours, noisy, clean = made / "ours.npy", made / "cycles.npy", made / "oidn.npz"
    times = [
        bench.run("ours", 30, case=name, folder=prepared.folder, run={"quality": quality}, pixels=ours),
        bench.run("cycles", 30, case=other.name, folder=theirs, samples=samples, seed=SEED, pixels=noisy),
    ]
    bench.run("oidn", 30, noisy=noisy, texels=theirs / "texels.npz", pixels=clean)
    with np.load(clean) as pages:
        np.save(made / "denoised.npy", pages[measured["cycles_oidn"][-1]["filter"]])
    ours_s, theirs_s = (each["cpu_seconds"] for each in times)
    say(f"{name}: {ours_s:.0f} s of ours, {theirs_s:.0f} s of {samples} samples")
    shown = [
        _seen(bench, prepared, name, prepared.folder, ours),
        _seen(bench, prepared, other.name, theirs, made / "denoised.npy"),
        _seen(bench, prepared, name, prepared.folder, None),
    ]
    target = bench.output / f"{name}-view.jpg"
    pictures.draw_strip(shown, target)
    return target


def samples_as_long(results: dict[str, Any], quality: str) -> int:
    """Return the samples with which Cycles and the denoiser take our processor time at a quality."""
    ours = next(entry["cpu_seconds"] for entry in results["ours"] if entry["label"] == quality)
    measured = [(entry["samples"], entry["cpu_seconds"]) for entry in results["cycles_oidn"]]
    slope, fixed = np.polyfit(*zip(*measured, strict=True), 1)
    return max(1, round((ours - fixed) / slope))


def _seen(bench: Bench, prepared: Prepared, case: str, folder: Path, lightmap: Path | None) -> Path:
    """Return the picture of a lightmap, or of the scene itself."""
    target = prepared.folder / "views" / f"{lightmap.stem if lightmap else 'traced'}.png"
    mean = float(prepared.mean[prepared.compared].mean())
    bench.run("view", 60, case=case, folder=folder, mean=mean, lightmap=lightmap, picture=target)
    return target


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", required=True, choices=WITH_BOTH)
    parser.add_argument("--quality", default="draft")
    parser.add_argument("--output", type=Path, default=RESULTS)
    chosen = parser.parse_args()
    bench = Bench(DEFAULT_CACHE, chosen.output, small=False, threads=os.cpu_count() or 1)
    say(f"wrote {draw_views(bench, chosen.case, chosen.quality)}")


if __name__ == "__main__":
    main()
