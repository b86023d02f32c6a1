"""Benchmarks: `python3 build.py bench [--case NAME …] [--small] [--calibrate]`."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from . import pictures, report
from .calibrate import calibrate
from .cases import CASES, ROOMS, SMALL_CASES
from .compare import DENOISER, Bench, best_pixels, compare, memory_of, prepare, say
from .growth import grow
from .processes import MeasurementError
from .sanity import complaints

ROOT = Path(__file__).resolve().parents[1]
DEFAULT_CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "radiosity" / "bench"


def main() -> int:
    options = parser().parse_args()
    cases = SMALL_CASES if options.small else CASES
    output = options.output or (ROOT / "out" / "bench" if options.small else ROOT / "bench" / "results")
    cache = options.cache or (ROOT / "out" / "bench" / "cache" if options.small else DEFAULT_CACHE)
    bench = Bench(cache, output, options.small, options.threads or os.cpu_count() or 1, options.presets)
    names = options.case or [*cases, ROOMS]
    if options.table:
        return 0 if report.update_readme(output, ROOT / "README.md") else 1
    if not pictures.AVAILABLE:
        say("matplotlib and Pillow are not installed: no pictures are drawn")
    if not DENOISER:
        say("pyoidn is not installed: nothing is denoised")
    failed = 0
    for name in names:
        case = cases.get(name)
        if name != ROOMS and case is None:
            say(f"{name}: has no small version, skipped")
            continue
        if case is not None and case.missing:
            say(f"{name}: skipped, {case.missing}")
            continue
        try:
            if options.references:
                if case is not None:
                    prepare(bench, case)
                continue
            wrong = _run(bench, name, options.calibrate)
        except MeasurementError as failure:
            wrong = [str(failure)]
        for complaint in wrong:
            print(f"{name}: {complaint}", file=sys.stderr)
        failed += bool(wrong)
    if not options.small and not options.references and not options.calibrate and output.is_relative_to(ROOT):
        report.update_readme(output, ROOT / "README.md")
    return 1 if failed else 0


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(prog="build.py bench", description="Measure against Cycles.")
    add = result.add_argument
    choices = [*CASES, ROOMS]
    add("--case", action="append", choices=choices, metavar="NAME",
        help=f"only this one, may be repeated: {', '.join(choices)}")  # fmt: skip
    add(
        "--small", action="store_true", help="small versions, in a minute, to out/bench: that everything runs"
    )
    add("--presets", action="store_true", help="draft, medium and high alone, no target errors")
    add("--references", action="store_true", help="only make what is cached: scenes and references")
    add("--calibrate", action="store_true", help="vary each setting alone, for what the error setting needs")
    add("--table", action="store_true", help="only write the README's table from the results that are there")
    add("--output", type=Path, metavar="DIR", help="where results go (default: bench/results)")
    add("--cache", type=Path, metavar="DIR", help=f"scenes and references (default: {DEFAULT_CACHE})")
    add("--threads", type=int, default=0, metavar="N", help="of both programs (default: all cores)")
    return result


def _run(bench: Bench, name: str, calibrating: bool) -> list[str]:
    """Measure one case and write its files; return what is wrong with its numbers."""
    if name == ROOMS:
        results = grow(bench)
        results["context"] = report.context(bench.threads)
        report.write(results, bench.output)
        if pictures.AVAILABLE:
            pictures.draw_growth(results, bench.output / "rooms.png")
        return complaints(results)
    case = (SMALL_CASES if bench.small else CASES)[name]
    if calibrating:
        results = calibrate(bench, case)
        results["context"] = report.context(bench.threads)
        report.write(results, bench.output)
        return []
    results = compare(bench, case)
    results["memory_MB"] = memory_of(results)
    results["context"] = report.context(bench.threads)
    report.write(results, bench.output)
    _draw(bench, name, results)
    return complaints(results)


def _draw(bench: Bench, name: str, results: dict[str, Any]) -> None:
    if not pictures.AVAILABLE:
        return
    pictures.draw_curves(results, bench.output / f"{name}.png")
    best = best_pixels(results)
    if best is not None:
        case = (SMALL_CASES if bench.small else CASES)[name]
        prepared = prepare(bench, case)
        path = bench.output / f"{name}-pixels.png"
        pictures.draw_triptych(best[1], prepared.mean, prepared.compared, path)


if __name__ == "__main__":
    sys.exit(main())
