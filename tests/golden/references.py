"""The rows' references: two bakes of each by Cycles, which differ in their seeds only."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.golden.exr import read_exr, write_exr
from tests.golden.rows import Row

FOLDER = Path(__file__).parent / "references"

MANTISSA = 7
"""Bits kept of the half floats' ten: rounding adds 0.16 % of noise to each texel, and a third of the
file is saved."""


@dataclass(frozen=True)
class References:
    """Two bakes of a row by Cycles.

    Parameters
    ----------
    first, second : (n, n, 3) float32
        H/π [W/m²/sr]; row 0 is v = 0.
    coverage : (n, n) bool
        The texels that Cycles wrote.
    """

    first: np.ndarray
    second: np.ndarray
    coverage: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        """(n, n, 3) float32: the better estimate of the two together."""
        return 0.5 * (self.first + self.second)


def files(row: Row) -> tuple[Path, Path]:
    """Return the two files of a row."""
    return FOLDER / f"{row.name}-1.exr", FOLDER / f"{row.name}-2.exr"


def read_index(family: str) -> dict[str, dict[str, Any]]:
    """Return what is known of a family's references, by row: the row's signature then, by what, how long."""
    path = _index(family)
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def write_index(family: str, index: dict[str, dict[str, Any]]) -> None:
    lines = [f"{json.dumps(name)}: {json.dumps(index[name])}" for name in sorted(index)]
    _index(family).write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def _index(family: str) -> Path:
    return FOLDER / f"{family}.json"


def save(row: Row, bakes: tuple[np.ndarray, np.ndarray], coverage: np.ndarray) -> int:
    """Write two (n, n, 3) bakes; returns their bytes together. Equal channels are kept once."""
    size = 0
    for path, bake in zip(files(row), bakes, strict=True):
        kept = _rounded(np.where(coverage[..., None], bake, 0.0))
        gray = (kept[..., :1] == kept).all()
        channels = {"Y": kept[..., 0]} if gray else {"RGB"[i]: kept[..., i] for i in range(3)}
        write_exr(path, {**channels, "A": coverage.astype(np.float16)})
        size += path.stat().st_size
    return size


def load(row: Row) -> References:
    pages = []
    for path in files(row):
        channels = read_exr(path)
        coverage = channels["A"] > 0
        pages.append(
            np.stack([channels["Y"] if "Y" in channels else channels[name] for name in "RGB"], axis=2)
        )
    return References(pages[0], pages[1], coverage)


def _rounded(values: np.ndarray) -> np.ndarray:
    """Return half floats of fewer bits, to nearest; a carry into the exponent is as it should be."""
    drop = 10 - MANTISSA
    bits = values.astype(np.float16).view(np.uint16).astype(np.int32)
    return (((bits + (1 << drop >> 1)) >> drop) << drop).astype(np.uint16).view(np.float16)
