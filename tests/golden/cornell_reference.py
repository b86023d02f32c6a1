"""The Cornell box's reference by Cycles: how it is kept."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

FILE = Path(__file__).parent / "cornell_box_cycles.npz"


@dataclass(frozen=True)
class Reference:
    """Two bakes of one scene by Cycles that differ in their seeds only.

    Parameters
    ----------
    uv : dict of (loops, 2) float32
        The layout, by object.
    first, second : (n, n, 3) float32
        H/π [W/m²/sr]; row 0 is v = 0.
    coverage : (n, n) bool
        The texels that Cycles wrote.
    """

    uv: dict[str, np.ndarray]
    first: np.ndarray
    second: np.ndarray
    coverage: np.ndarray

    @property
    def resolution(self) -> int:
        return len(self.coverage)

    @property
    def mean(self) -> np.ndarray:
        """(n, n, 3) float32: the better estimate of the two together."""
        return 0.5 * (self.first + self.second)

    def save(self, path: Path, about: str) -> None:
        """Write what is covered as half floats: an error of 3e-4, a tenth of the bakes' own noise."""
        arrays = {f"uv {name}": uv.astype(np.float32) for name, uv in self.uv.items()}
        np.savez_compressed(
            path,
            about=np.array(about),
            coverage=np.packbits(self.coverage),
            resolution=np.array(self.resolution),
            first=self.first[self.coverage].astype(np.float16),
            second=self.second[self.coverage].astype(np.float16),
            **arrays,
        )


def load(path: Path = FILE) -> Reference:
    with np.load(path) as file:
        size = int(file["resolution"])
        coverage = np.unpackbits(file["coverage"], count=size * size).reshape(size, size).astype(bool)
        pages = []
        for name in ("first", "second"):
            page = np.zeros((size, size, 3), dtype=np.float32)
            page[coverage] = file[name]
            pages.append(page)
        uv = {key.removeprefix("uv "): file[key] for key in file.files if key.startswith("uv ")}
    return Reference(uv, pages[0], pages[1], coverage)
