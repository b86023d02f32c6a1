"""Results to look at; without matplotlib and Pillow there are none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

try:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import LogLocator, NullFormatter
    from PIL import Image

    AVAILABLE = True
except ModuleNotFoundError:
    AVAILABLE = False

BLUE, ORANGE, GREEN = "#2166ac", "#e08214", "#1b9e77"
DPI = 110


def draw_curves(results: dict[str, Any], path: Path) -> None:
    """Draw error against time of all three, doubly logarithmic."""
    figure, panel = plt.subplots(figsize=(6.4, 4.2), constrained_layout=True)
    for who, name, color, style in (
        ("ours", "ours", BLUE, "o-"),
        ("cycles", "Cycles", ORANGE, "s-"),
        ("cycles_oidn", "Cycles + Open Image Denoise", GREEN, "^-"),
    ):
        entries = sorted((e for e in results[who] if "error" in e), key=lambda e: e["seconds"])
        if not entries:
            continue
        seconds, errors = [e["seconds"] for e in entries], [max(e["error"], 1e-4) for e in entries]
        panel.loglog(seconds, errors, style, color=color, label=name)
        for entry, x, y in zip(entries, seconds, errors, strict=True):
            text = entry["label"] if who == "ours" else f"{entry['samples']}"
            panel.annotate(text, (x, y), xytext=(4, 4), textcoords="offset points", fontsize=7, color=color)
        if who == "cycles":
            x = np.array([seconds[-1], 30 * seconds[-1]])
            panel.loglog(x, errors[-1] * (x / x[0]) ** -0.5, "--", color=color, linewidth=1)
    for row in results["at_equal_error"]:
        panel.axhline(row["error"], color="0.8", linewidth=0.7, zorder=0)
    made = results["context"]
    panel.set(
        xlabel=f"seconds ({made['date'].split()[0]}, {made['commit']}, {made['machine']['cores']} cores)",
        ylabel="relative RMSE",
        title=f"{results['title']}: {results['texels']:,} texels, {results['triangles']:,} triangles",
    )
    _plain_numbers(panel.yaxis)
    _plain_numbers(panel.xaxis)
    panel.grid(True, which="both", color="0.93", linewidth=0.5)
    panel.legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=DPI, metadata={"Software": None})
    plt.close(figure)


def draw_growth(results: dict[str, Any], path: Path) -> None:
    """Draw time, memory and links against triangles."""
    rows = [row for row in results["rooms"] if "failed" not in row]
    figure, panels = plt.subplots(1, 3, figsize=(10, 3.3), constrained_layout=True)
    sizes = [row["triangles"] for row in rows]
    for panel, name, unit in zip(
        panels, ("seconds", "memory_MB", "links_per_leaf"), ("s", "MB", ""), strict=True
    ):
        values = [row[name] for row in rows]
        if rows:
            panel.loglog(sizes, values, "o-", color=BLUE)
        exponent = results["exponents"].get(name)
        title = {
            "seconds": "solve time",
            "memory_MB": "peak memory",
            "links_per_leaf": "links a leaf element",
        }[name]
        growth = f" $\\propto n^{{{exponent:.2f}}}$" if exponent is not None else ""
        panel.set(xlabel="triangles", title=title + growth)
        panel.set_ylabel(unit)
        _plain_numbers(panel.yaxis)
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.grid(True, which="both", color="0.93", linewidth=0.5)
    figure.savefig(path, dpi=DPI, metadata={"Software": None})
    plt.close(figure)


def draw_farm(results: dict[str, Any], path: Path) -> None:
    """Draw how much faster a shared bake is, against workers, and what it cannot exceed."""
    rows = [row for row in results["simulated"] if row["workers"]]
    workers = [row["workers"] for row in rows]
    parts = results["with_most"]
    shared, alone = parts["all_tasks"], results["alone"]
    figure, panel = plt.subplots(figsize=(6.4, 4.2), constrained_layout=True)
    panel.semilogx(workers, [row["speedup"] for row in rows], "o-", color=BLUE, label="simulated")
    ideal = [alone / (parts["not_shared"] + shared / (count + 1)) for count in workers]
    panel.semilogx(workers, ideal, "--", color=ORANGE, label="if tasks were divisible, and sharing free")
    panel.axhline(alone / parts["not_shared"], color="0.6", linewidth=1, label="without all that is shared")
    settings = results["settings"]
    panel.set(
        xlabel="workers, a core each",
        ylabel="times as fast as alone",
        title=f"office, {settings['resolution']}², {settings['quality']}",
        ylim=(0.0, None),
    )
    panel.grid(True, which="both", color="0.93", linewidth=0.5)
    panel.legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=DPI, metadata={"Software": None})
    plt.close(figure)


def _plain_numbers(axis: Any) -> None:
    """Label 1, 2, 5, 10 … as they are."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=30))
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_formatter(NullFormatter())


def draw_triptych(ours: np.ndarray, reference: np.ndarray, compared: np.ndarray, path: Path) -> None:
    """Put our lightmap, the references' mean, and ten times their difference side by side.

    All three have one exposure. Row 0 is the bottom.
    """
    error = 10 * np.abs(ours - reference) * compared[..., None]
    exposure = 0.8 / max(np.quantile(reference[compared].max(axis=1), 0.98), 1e-9)
    gap = np.ones((len(ours), 4, 3), dtype=np.float32)
    strip = np.concatenate([ours, gap, reference, gap, error], axis=1) * exposure
    shown = (np.clip(strip[::-1], 0, 1) ** (1 / 2.2) * 255 + 0.5).astype(np.uint8)
    Image.fromarray(shown).save(path, optimize=True)


def draw_strip(paths: list[Path], target: Path) -> None:
    """Put pictures of one size side by side."""
    shown = [np.asarray(Image.open(path).convert("RGB")) for path in paths]
    gap = np.full((len(shown[0]), 8, 3), 255, dtype=np.uint8)
    strip = np.concatenate([part for picture in shown for part in (gap, picture)][1:], axis=1)
    Image.fromarray(strip).save(target, quality=88, optimize=True)
