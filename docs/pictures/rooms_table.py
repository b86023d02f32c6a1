"""The table of docs/rooms.md, from what two versions' bakes cost and what the benchmarks measured.

    python -m docs.pictures.rooms_table

writes it into the page, between its markers; nothing here needs Blender.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "rooms.md"
RESULTS = ROOT / "bench" / "results"
COSTS = RESULTS / "layouts.json"
BEGIN, END = "<!-- rooms: begin -->", "<!-- rooms: end -->"

BEFORE, AFTER = "before", "after"
STAGES = ("unwrap", "rasterise", "solve", "light")

TITLES = {
    "classroom": "Classroom",
    "staircase": "Staircase",
    "sponza": "Sponza",
    "platformer": "Platformer",
    "game-map": "Game map",
    "office": "Office",
}
BENCHMARKS = {"office": "interior"}
"""The case in which a room is compared with Cycles, where it has another name."""

HEAD = """\
| room | | used | texels/m | unwrap | rasterize | solve | light | whole bake | memory | error | apart | best |
|---|---|---|---|---|---|---|---|---|---|---|---|---|"""


def costs_of(output: Path) -> dict[str, Any]:
    """Return what the bake in a folder cost and what it made of its page."""
    report = json.loads((output / "report.json").read_text(encoding="utf-8"))
    cost = json.loads((output / "cost.json").read_text(encoding="utf-8"))
    (page,) = report["pages"]
    return {
        "commit": cost["commit"],
        "used_texels": cost["used_texels"],
        "own_texels": cost["own_texels"],
        "texels_per_meter": round(page["texels_per_metre"], 4),
        "processor_seconds": {stage: round(report["seconds"][stage], 1) for stage in STAGES},
        "whole_bake": cost["processor_seconds"],
        "peak_MB": cost["peak_MB"],
    }


def table(costs: dict[str, Any]) -> str:
    """Return the table as Markdown."""
    rows = [
        _row(title, when, costs[name][when], _errors(name) if when == AFTER else ("", "", ""))
        for name, title in TITLES.items()
        for when in (BEFORE, AFTER)
        if when in costs.get(name, {})
    ]
    return "\n".join([HEAD, *rows])


def _row(title: str, when: str, cost: dict[str, Any], errors: tuple[str, str, str]) -> str:
    density, own = cost["texels_per_meter"], cost["own_texels"]
    cells = [
        title if when == BEFORE else "",
        when,
        f"{cost['used_texels']:.0%}" + (f" ({own:.0%})" if own < cost["used_texels"] else ""),
        f"{density:.1f}" if density >= 10 else f"{density:.2f}",
        *(f"{cost['processor_seconds'][stage]:.0f} s" for stage in STAGES),
        f"{cost['whole_bake']:.0f} s",
        f"{cost['peak_MB'] / 1000:.1f} GB",
        *errors,
    ]
    return f"| {' | '.join(cells)} |"


def _errors(name: str) -> tuple[str, str, str]:
    """Return a room's error at draft quality, and those without coincident faces and the worst texels."""
    path = RESULTS / f"{BENCHMARKS.get(name, name)}.json"
    if not path.is_file():
        return "–", "–", "–"
    bakes = json.loads(path.read_text(encoding="utf-8"))["ours"]
    (draft,) = (bake for bake in bakes if bake["settings"] == {"quality": "draft"})
    error, apart, best = (draft.get(key) for key in ("error", "without_coincident", "without_worst_01"))
    return f"{error:.1%}", "–" if apart is None else f"{apart:.1%}", f"{best:.1%}"


def page_with_table(page: str, costs: dict[str, Any]) -> str:
    """Return the page's text with the table between its markers."""
    head, rest = page.split(BEGIN, 1)
    return f"{head}{BEGIN}\n{table(costs)}\n{END}{rest.split(END, 1)[1]}"


def write_table() -> None:
    """Put the table into the page."""
    costs = json.loads(COSTS.read_text(encoding="utf-8"))["costs"]
    PAGE.write_text(page_with_table(PAGE.read_text(encoding="utf-8"), costs), encoding="utf-8")


if __name__ == "__main__":
    write_table()
