"""Results as files: JSON, pictures, and a table for the README."""

from __future__ import annotations

import datetime
import json
import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

BEGIN, END = "<!-- bench: begin -->", "<!-- bench: end -->"
ROOT = Path(__file__).resolve().parents[1]


def context(threads: int) -> dict[str, Any]:
    """Return when, where and with what something was measured."""
    return {
        "date": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "commit": _commit(),
        "machine": {
            "processor": _processor(),
            "cores": os.cpu_count(),
            "threads": threads,
            "memory_GB": _memory(),
            "system": platform.platform(),
        },
        "versions": {
            "python": platform.python_version(),
            **{name: _version(name) for name in ("bpy", "numpy", "embreex", "pyoidn")},
        },
    }


def write(results: dict[str, Any], folder: Path) -> Path:
    """Write one case's results as JSON."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{results['case']}.json"
    path.write_text(json.dumps(_rounded(results), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return path


def update_readme(folder: Path, readme: Path) -> bool:
    """Put the table of all results of a folder between the README's markers; False if it has none."""
    text = readme.read_text(encoding="utf-8")
    if BEGIN not in text or END not in text:
        return False
    head, rest = text.split(BEGIN, 1)
    tail = rest.split(END, 1)[1]
    readme.write_text(f"{head}{BEGIN}\n{table(folder)}\n{END}{tail}", encoding="utf-8")
    return True


def table(folder: Path) -> str:
    """Return the results of a folder as Markdown tables."""
    found = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.json"))]
    compared = [results for results in found if "at_equal_error" in results]
    parts = [_compared_table(compared), _qualities_table(compared)] if compared else []
    parts += [_rooms_table(results) for results in found if "rooms" in results]
    return "\n\n".join(parts) if parts else "No results yet: `python3 build.py bench` makes them."


def _compared_table(compared: list[dict[str, Any]]) -> str:
    lines = [
        "| scene | error | ours | Cycles | ratio | Cycles + OIDN | ratio |",
        "|---|---|---|---|---|---|---|",
    ]
    for results in sorted(compared, key=lambda r: (r["case"] not in ("cornell", "interior"), r["case"])):
        scene = f"{results['title']}, {results['triangles']:,} triangles, {results['resolution']}²"
        rows = results["at_equal_error"]
        for row in [row for row in rows if row["ours"]] or rows[:1]:
            oidn = _time(row["cycles_oidn"]) if row["cycles_oidn"] else "not reached"
            lines.append(
                f"| {scene} | {row['error']:.0%} | {_time(row['ours']) if row['ours'] else _best(results)} | "
                f"{_time(row['cycles'])} | {_times(row['ratio_to_cycles'])} | "
                f"{oidn} | {_times(row['ratio_to_cycles_oidn'])} |"
            )
            scene = ""
    notes = sorted({_where(results) for results in compared})
    return "\n".join([*lines, "", "\\* extrapolated by samples^(-1/2). " + " ".join(notes)])


def _qualities_table(compared: list[dict[str, Any]]) -> str:
    """Return each quality's error and processor time, and what the others take to the same error."""
    lines = [
        "| scene | quality | error | estimated | without coincident faces | without the worst 1 % "
        "| processor time | Cycles | Cycles + OIDN |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for results in sorted(compared, key=lambda r: (r["case"] not in ("cornell", "interior"), r["case"])):
        scene, bakes = results["title"], {entry["label"]: entry for entry in results["ours"]}
        for row in results["at_our_errors"]:
            times, error = row.get("processor"), bakes[row["label"]]
            if times is None or "quality" not in error["settings"]:
                continue
            oidn, apart = times["ratio_to_cycles_oidn"], _percent(error.get("without_coincident"))
            estimated = _percent(error.get("estimated_error"))
            lines.append(
                f"| {scene} | {row['label']} | {row['error']:.1%} | {estimated} | {apart} | "
                f"{error['without_worst_1']:.1%} | "
                f"{_time({'seconds': times['seconds'], 'kind': 'measured'})} | "
                f"{_times(times['ratio_to_cycles'])} | {'not reached' if oidn is None else _times(oidn)} |"
            )
            scene = ""
    return "\n".join(lines)


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{value:.1%}"


def _rooms_table(results: dict[str, Any]) -> str:
    lines = [
        "| closed room | solved in | links | leaf elements | links a leaf | memory |",
        "|---|---|---|---|---|---|",
    ]
    for row in results["rooms"]:
        room = f"| {row['triangles']:,} triangles"
        if "failed" in row:
            lines.append(f"{room} | {row['failed']} | | | | |")
            continue
        counts = f"{row['links']:,} | {row['leaves']:,} | {row['links_per_leaf']:.1f}"
        lines.append(f"{room} | {row['seconds']:.1f} s | {counts} | {row['memory_MB'] / 1e3:.2f} GB |")
    bake = results["bake"]
    room = f"| {bake['triangles']:,} triangles, baked at {bake['resolution']}²"
    if "failed" in bake:
        lines.append(f"{room} | {bake['failed']} | | | | |")
    else:
        lines.append(f"{room} | {bake['seconds']:.1f} s in all | | | | {bake['memory_MB'] / 1e3:.2f} GB |")
    exponent = results["exponents"].get("seconds")
    growth = (
        f"Solve time grows as triangles^{exponent:.2f} from {results['fitted_from']:,} on. "
        if exponent is not None
        else ""
    )
    return "\n".join([*lines, "", f"{growth}Quality {results['quality']}. {_where(results)}"])


def _where(results: dict[str, Any]) -> str:
    made = results["context"]
    machine = made["machine"]
    return (
        f"Measured {made['date'].split()[0]} at {made['commit']} on {machine['cores']} cores of "
        f"{machine['processor']}, Blender {made['versions']['bpy']}."
    )


def _best(results: dict[str, Any]) -> str:
    errors = [entry["error"] for entry in results["ours"] if "error" in entry]
    return f"not reached (best {min(errors):.1%})" if errors else "failed"


def _time(reading: dict[str, Any] | None) -> str:
    if reading is None:
        return "–"
    seconds = reading["seconds"]
    text = f"{seconds:.2g}" if seconds < 10 else f"{seconds:,.0f}"
    return f"{text} s" + ("\\*" if reading["kind"] == "extrapolated" else "")


def _times(value: float | None) -> str:
    if value is None:
        return "–"
    return f"{value:.2g}×" if value < 10 else f"{value:,.0f}×"


def _rounded(value: Any) -> Any:
    """Keep five digits, and leave out where pixels lie on this machine."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items() if key != "pixels"}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    if isinstance(value, float):
        return float(f"{value:.5g}")
    return value


def _commit() -> str:
    """Return the commit, with `-dirty` if other files than results differ from it."""
    commit = _git("rev-parse", "--short=10", "HEAD")
    changed = _git("status", "--porcelain", "--", ".", ":!bench/results", ":!README.md")
    return f"{commit}-dirty" if commit and changed else commit or "unknown"


def _git(*words: str) -> str:
    """Return what git says, nothing where it cannot."""
    try:
        done = subprocess.run(("git", "-C", str(ROOT), *words), capture_output=True, text=True, check=False)
    except OSError:
        return ""
    return done.stdout.strip()


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _memory() -> float | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1)
    except (ValueError, OSError, AttributeError):
        return None


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
