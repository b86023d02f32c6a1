"""One case from end to end: prepare, references, our bakes and Cycles', and what follows from them."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from . import curves, processes
from .cases import ERROR_SETTING, Case, label, with_asked_errors
from .error_measure import block_error, error_figures, relative_rmse

MAX_BUSY = 0.2
"""Cores that may be busy elsewhere before times are doubted."""

DENOISER = find_spec("pyoidn") is not None

SEED = 1000
"""Of Cycles' measured bakes; references have 1 and 2."""


@dataclass
class Bench:
    """Where things go, and what is the same for all cases.

    Parameters
    ----------
    cache : Path
        Scenes and references, by the case's key.
    output : Path
        Results.
    small : bool
    threads : int
    presets : bool
        The qualities alone, no target errors.
    """

    cache: Path
    output: Path
    small: bool
    threads: int
    presets: bool = False
    busy_elsewhere: list[float] = field(default_factory=list)
    """Cores that others kept busy during each measurement."""

    def run(self, task: str, minutes: float, **job: Any) -> dict[str, Any]:
        result = processes.run(task, minutes, small=self.small, threads=self.threads, **job)
        self.busy_elsewhere.append(result["busy_elsewhere"] or 0.0)
        return result

    def quietness(self) -> dict[str, float]:
        """Return how quiet the machine was since the last call, and say if it was not."""
        busiest = max(self.busy_elsewhere, default=0.0)
        self.busy_elsewhere.clear()
        if busiest > MAX_BUSY:
            say(f"other processes kept {busiest:.1f} cores busy: the times are too long")
        return {"most_cores_busy_elsewhere": busiest}


@dataclass(frozen=True)
class Prepared:
    """A case's folder in the cache, the compared texels, those on coincident faces, and two references."""

    case: Case
    folder: Path
    compared: np.ndarray
    coincident: np.ndarray
    triangles: int
    first: np.ndarray
    second: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        return 0.5 * (self.first + self.second)

    @property
    def noise(self) -> float:
        """The noise of the references' mean, relative to it."""
        one, two = (page[self.compared].astype(float) for page in (self.first, self.second))
        return float(np.sqrt(((one - two) ** 2).mean()) / 2 / self.mean[self.compared].mean())

    def judged(self, pixels: np.ndarray) -> dict[str, float]:
        at = self.compared
        figures = error_figures(pixels[at], self.first[at], self.second[at])
        apart = at & ~self.coincident
        figures["without_coincident"] = relative_rmse(pixels[apart], self.first[apart], self.second[apart])
        return {**figures, "block_error": block_error(pixels, self.first, self.second, at)}


def say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def prepare(bench: Bench, case: Case) -> Prepared:
    """Have the case's scene and references in the cache."""
    folder = bench.cache / case.key()
    job = {"case": case.name, "folder": folder}
    texels = folder / "texels.npz"
    if not texels.is_file():
        say(f"{case.name}: preparing {folder}")
        bench.run("prepare", 30, **job)
    references = []
    for seed in (1, 2):
        # The same name as in prepare.py, which needs Blender.
        name = f"reference-{case.reference_samples}-bounces-128-seed-{seed}.npy"
        if not (folder / name).is_file():
            say(f"{case.name}: reference {seed} of {case.reference_samples} samples")
            figures = bench.run(
                "cycles", 120, **job, samples=case.reference_samples, seed=seed, pixels=folder / name
            )
            say(f"{case.name}: reference {seed} took {figures['seconds']:.0f} s")
        references.append(np.load(folder / name))
    with np.load(texels) as file:
        masks = file["compared"], file["coincident"]
        return Prepared(case, folder, *masks, int(file["triangles"]), *references)


def compare(bench: Bench, case: Case) -> dict[str, Any]:
    """Measure a case and return its results; the pixels of all bakes stay in the cache."""
    prepared = prepare(bench, case)
    bench.busy_elsewhere.clear()
    bakes = prepared.folder / "bakes"
    bakes.mkdir(exist_ok=True)
    ours = [
        our_bake(bench, prepared, run, bakes / f"ours-{n}.npy") for n, run in enumerate(_runs(bench, case))
    ]
    cycles, denoised = [], []
    for samples in case.samples:
        pixels = bakes / f"cycles-{samples}.npy"
        cycles.append(cycles_bake(bench, prepared, samples, pixels))
        if "error" in cycles[-1] and DENOISER:
            denoised.append(denoise(bench, prepared, cycles[-1], pixels))
    found = {
        "case": case.name,
        "title": case.title,
        "resolution": case.resolution,
        "texels": int(prepared.compared.sum()),
        "triangles": prepared.triangles,
        "reference": {"samples": case.reference_samples, "seeds": [1, 2], "noise_of_mean": prepared.noise},
        "ours": ours,
        "cycles": cycles,
        "cycles_oidn": denoised,
        "quietness": bench.quietness(),
    }
    return {**found, **conclusions(found, case.targets)}


def _runs(bench: Bench, case: Case) -> tuple[dict[str, Any], ...]:
    return case.runs if bench.small or bench.presets else with_asked_errors(case)


def our_bake(bench: Bench, prepared: Prepared, run: dict[str, Any], pixels: Path) -> dict[str, Any]:
    """Bake with the add-on and judge it; "failed" says why there is nothing to judge."""
    case = prepared.case
    entry: dict[str, Any] = {"label": label(run), "settings": run}
    job = {"case": case.name, "folder": prepared.folder, "run": run, "pixels": pixels}
    try:
        entry |= bench.run("ours", case.minutes, **job)
    except processes.MeasurementError as failure:
        say(f"{case.name}: ours, {entry['label']}: {failure}")
        return {**entry, "failed": str(failure)}
    entry |= prepared.judged(np.load(pixels)) | {"pixels": str(pixels)}
    say(f"{case.name}: ours, {entry['label']}: {entry['seconds']:.2f} s, {entry['error']:.2%}")
    return entry


def cycles_bake(bench: Bench, prepared: Prepared, samples: int, pixels: Path) -> dict[str, Any]:
    """Bake with Cycles and judge it."""
    case = prepared.case
    job = {"case": case.name, "folder": prepared.folder, "samples": samples, "seed": SEED + samples}
    try:
        entry = {"samples": samples, **bench.run("cycles", case.minutes, **job, pixels=pixels)}
    except processes.MeasurementError as failure:
        say(f"{case.name}: Cycles, {samples} samples: {failure}")
        return {"samples": samples, "failed": str(failure)}
    entry |= prepared.judged(np.load(pixels))
    say(f"{case.name}: Cycles, {samples} samples: {entry['seconds']:.2f} s, {entry['error']:.2%}")
    return entry


def denoise(bench: Bench, prepared: Prepared, noisy: dict[str, Any], pixels: Path) -> dict[str, Any]:
    """Denoise a bake of Cycles' with both filters and keep the better: its time is both programs'."""
    case, samples = prepared.case, noisy["samples"]
    target = pixels.with_name(f"oidn-{samples}.npz")
    job = {"noisy": pixels, "texels": prepared.folder / "texels.npz", "pixels": target}
    try:
        found = bench.run("oidn", case.minutes, **job)
    except processes.MeasurementError as failure:
        say(f"{case.name}: Open Image Denoise: {failure}")
        return {"samples": samples, "failed": str(failure)}
    with np.load(target) as pages:
        judged = {name: prepared.judged(pages[name]) for name in pages.files}
    best = min(judged, key=lambda name: judged[name]["error"])
    alone = found["filters"][best]
    entry = {
        "samples": samples,
        "filter": best,
        "seconds": noisy["seconds"] + alone["seconds"],
        "cpu_seconds": noisy["cpu_seconds"] + alone["cpu_seconds"],
        "denoiser_seconds": alone["seconds"],
        "memory_MB": max(noisy["memory_MB"], found["memory_MB"]),
        "errors_of_filters": {name: figures["error"] for name, figures in judged.items()},
        **judged[best],
    }
    say(f"{case.name}: the same denoised ({best}): {entry['seconds']:.2f} s, {entry['error']:.2%}")
    return entry


def conclusions(found: dict[str, Any], targets: tuple[float, ...]) -> dict[str, Any]:
    """Return the time ratios at equal errors, and at the errors of our bakes."""
    presets = [entry for entry in found["ours"] if "error" in entry]
    ours, cycles, oidn = (_points(found[who]) for who in ("ours", "cycles", "cycles_oidn"))
    at_targets = []
    for target in targets:
        our_time = curves.time_to_reach(ours, target)
        row: dict[str, Any] = {"error": target, "ours": _reading(our_time)}
        for who, reading in (
            ("cycles", curves.time_of_sampling(cycles, target)),
            ("cycles_oidn", curves.time_to_reach(oidn, target)),
        ):
            row[who] = _reading(reading)
            row[f"ratio_to_{who}"] = curves.ratio(reading, our_time)
        at_targets.append(row)
    at_ours = [
        {"label": entry["label"], "error": entry["error"]}
        | _times_at(found, entry, "seconds")
        | {"processor": _times_at(found, entry, "cpu_seconds")}
        for entry in presets
    ]
    order = curves.sampling_order(cycles) if len(cycles) > 1 else None
    asked = [entry for entry in presets if ERROR_SETTING and ERROR_SETTING in entry["settings"]]
    calibration = [
        {"asked": entry["settings"][ERROR_SETTING], "measured": entry["error"],
         "estimated": entry.get("estimated_error"), "seconds": entry["seconds"]}
        for entry in asked
    ]  # fmt: skip
    return {
        "at_equal_error": at_targets,
        "at_our_errors": at_ours,
        "order_of_cycles": order,
        "asked_errors": calibration,
    }


def _times_at(found: dict[str, Any], entry: dict[str, Any], clock: str) -> dict[str, Any]:
    """Return what the others take, by a clock, to the error of one of our bakes."""
    mine, error = curves.Reading(entry[clock], "measured"), max(entry["error"], 1e-6)
    times: dict[str, Any] = {"seconds": entry[clock]}
    for who, reading in (
        ("cycles", curves.time_of_sampling(_points(found["cycles"], clock), error)),
        ("cycles_oidn", curves.time_to_reach(_points(found["cycles_oidn"], clock), error)),
    ):
        times[who] = _reading(reading)
        times[f"ratio_to_{who}"] = curves.ratio(reading, mine)
    return times


def _points(entries: list[dict[str, Any]], clock: str = "seconds") -> list[curves.Point]:
    return [
        curves.Point(entry[clock], max(entry["error"], 1e-6), entry.get("samples"))
        for entry in entries
        if "error" in entry
    ]


def _reading(reading: curves.Reading | None) -> dict[str, Any] | None:
    return None if reading is None else {"seconds": reading.seconds, "kind": reading.kind}


def best_pixels(found: dict[str, Any]) -> tuple[str, np.ndarray] | None:
    """Return the label and the pixels of our most exact bake."""
    judged = [entry for entry in found["ours"] if "error" in entry]
    if not judged:
        return None
    best = min(judged, key=lambda entry: entry["error"])
    return best["label"], np.load(best["pixels"])


def memory_of(found: dict[str, Any]) -> dict[str, float]:
    """Return the largest peak of each program [MB]."""
    who = ("ours", "cycles", "cycles_oidn")
    return {w: max(chain([0.0], (e["memory_MB"] for e in found[w] if "memory_MB" in e))) for w in who}
