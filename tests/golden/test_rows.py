"""The rows of the gallery against Cycles, texel by texel on the same layout, shadows' borders included."""

from __future__ import annotations

from pathlib import Path

import bpy
import pytest

from tests.golden import references
from tests.golden.comparison import compare
from tests.golden.gallery import read_record
from tests.golden.pictures import write_png
from tests.golden.rows import FAMILIES, ROWS

PICTURES = Path(__file__).resolve().parents[2] / "out" / "golden"

MEAN = 0.015
"""Each bake's mean is this near to Cycles', whatever its RMSE may be."""

TOLD = 0.001
"""The gallery's number is this near to what is measured now."""


VARIANTS = {
    "area-disk", "area-rectangle", "area-spread", "area-spread-narrow", "area-spread-none",
    "glass-closed", "glass-light-path", "glass-thin", "glass-tinted",
    "lamp-blackbody", "lamp-color", "lamp-exposure", "metal-matte",
    "sky-hosek-wilkie", "sky-preetham", "spot-hard", "spot-square", "spot-stretched", "world-hdri",
}  # fmt: skip
"""Rows of which another differs in a number or a node only; `build.py test --full` runs them, too."""


def rows() -> list[object]:
    """All rows; those of lamps and shapes look the same in every Blender."""
    same = {"lights", "geometry"}
    return [
        pytest.param(
            name,
            marks=[
                *([pytest.mark.one_blender] if row.family in same else []),
                *([pytest.mark.full] if name in VARIANTS else []),
            ],
        )
        for name, row in ROWS.items()
    ]


@pytest.mark.parametrize("name", rows())
def test_row(name: str) -> None:
    row = ROWS[name]
    if bpy.app.version < row.needs:
        pytest.skip(f"Blender {bpy.app.version_string} does not have it")
    known = references.read_index(row.family).get(name, {}).get("signature")
    assert known == row.signature, f"make its references: python -m tests.golden.make_references {name}"
    comparison = compare(row)
    # The picture for the eye: ours, Cycles, and ten times the difference.
    write_png(PICTURES / f"{name}.png", comparison.strip())
    assert comparison.compared.sum() > 0.9 * comparison.theirs.coverage.sum()
    assert comparison.relative_rmse < row.limit
    told = read_record()[name]
    if told["blender"] == list(bpy.app.version[:2]):
        advice = f"the gallery tells of another error: python3 build.py figures gallery {name}"
        assert comparison.relative_rmse == pytest.approx(told["error"], abs=TOLD), advice
    assert comparison.mean_ratio == pytest.approx(1.0, abs=MEAN)


def test_references_have_rows() -> None:
    """No file is left behind when a row goes."""
    assert ROWS.keys() > VARIANTS
    wanted = {path.name for row in ROWS.values() for path in references.files(row)}
    assert {path.name for path in references.FOLDER.glob("*.exr")} == wanted
    assert [name for family in FAMILIES for name in references.read_index(family)] == sorted(
        ROWS, key=lambda name: (FAMILIES.index(ROWS[name].family), name)
    )
