"""The text of `docs/gallery.md`, from the rows and what was measured of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.golden.rows import FAMILIES, ROWS, Row

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "gallery.md"
IMAGES = ROOT / "docs" / "images" / "gallery"
RECORD = Path(__file__).parent / "gallery.json"

INTRODUCTION = """\
# Gallery

The Blender features that bakes support, row by row. Each row is a small scene, baked at medium quality and
compared with Cycles texel by texel, on the same layout. From left to right:

1. the scene with our lightmaps (objects without a lightmap are lit by Cycles);
2. our lightmap (H/π);
3. Cycles' lightmap, the mean of two bakes with different seeds;
4. ten times the difference, which includes the noise of Cycles.

Most scenes are a floor with two walls, a box that stands on it and a slab that floats. In the
lightmap the floor is at the lower left, the back wall above it, the left wall to its right; the six sides
of box and slab are at the upper right.

**relRMSE** is the root mean square error over all texels, including shadow borders, relative to
the mean light; two independent references cancel their own noise. The limit is 3 % unless
another one is given. The **mean** is that of all texels, relative to Cycles'. The golden
tests bake the rows, variants of others with `build.py test --full` only, and fail if an error exceeds its
limit or differs from the number on this page.

`python3 build.py figures gallery` writes this page; the scenes are in `tests/golden/rows`, the
references and the script that makes them in `tests/golden`.
"""

CHAPTERS = {
    "lights": ("Lamps", "Shapes, softness, colors, and which objects they light."),
    "world": ("Worlds", "Plain skies, images, and the Sky Texture."),
    "materials": ("Materials", "Reflection, transparency and emission."),
    "glass": (
        "Glass",
        "Light goes straight through it. In Cycles' references all glass is transparent to shadow and "
        "diffuse rays, of its own color.",
    ),
    "geometry": ("Geometry", "Everything that is rendered as a mesh, near and far, large and small."),
}
"""Title and first line of each family's chapter."""

USUAL_LIMIT, USUAL_RESOLUTION = 0.03, 128


def picture(name: str) -> Path:
    """Return where a row's picture is."""
    return IMAGES / f"{name}.png"


def page(record: dict[str, dict[str, Any]]) -> str:
    """Return the whole page; rows that were not measured yet are left out."""
    parts = [INTRODUCTION]
    for family in FAMILIES:
        title, first = CHAPTERS[family]
        rows = [row for row in ROWS.values() if row.family == family and row.name in record]
        parts.append(f"\n## {title}\n\n{first} {_summary(rows, record)}\n")
        parts += [_section(row, record[row.name]) for row in rows]
    return "".join(parts)


def _summary(rows: list[Row], record: dict[str, dict[str, Any]]) -> str:
    if not rows:
        return ""
    errors = sorted(record[row.name]["error"] for row in rows)
    middle, most = _percent(errors[(len(errors) - 1) // 2]), _percent(errors[-1])
    return f"{len(rows)} rows, half of them up to {middle}, all up to {most}."


def _section(row: Row, entry: dict[str, Any]) -> str:
    hidden = "" if entry["error"] > 0 else " (less than the references' own noise)"
    notes = [f"relRMSE **{_percent(entry['error'])}**{hidden}", f"mean {_signed(entry['mean_ratio'] - 1)}"]
    if row.limit != USUAL_LIMIT:
        notes.append(f"{100 * row.limit:g} % are allowed")
    if row.resolution != USUAL_RESOLUTION:
        notes.append(f"{row.resolution}²")
    notes.append(f"Cycles 2 × {row.samples} samples")
    if row.needs > (4, 2):
        notes.append("Blender {}.{} or newer".format(*row.needs))
    link = f"images/gallery/{picture(row.name).name}"
    return f"\n### {row.name}\n\n{row.title}. {', '.join(notes)}.\n\n![{row.title}]({link})\n"


def _percent(share: float) -> str:
    return f"{100 * share:.2f} %"


def _signed(share: float) -> str:
    """Return a difference as a percentage with a sign, or none where it rounds to 0."""
    tenths = round(1000 * share)
    return f"{tenths / 10:+.1f} %" if tenths else "±0.0 %"
