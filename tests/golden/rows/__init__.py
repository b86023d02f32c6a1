"""Small scenes, one a feature of Blender, each compared with Cycles: the rows of `docs/gallery.md`.

A row is a function that builds its scene into an empty file. It is marked with `row`, which says how near
to Cycles the bake must come. What gets a lightmap needs a UV layer `Lightmap` (see `stage`), the same in
every version of Blender, so that texels match one by one.
"""

from __future__ import annotations

import hashlib
import importlib
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from types import FunctionType

FAMILIES = ("lights", "world", "materials", "glass", "geometry")
"""The modules of this folder that hold rows, in the gallery's order."""


@dataclass(frozen=True)
class Row:
    """One scene, and what is promised of it.

    Parameters
    ----------
    name : str
        Also of its references' files.
    family : str
        The module it stands in.
    build : callable
        Builds the scene into the open, empty file.
    limit : float
        The relative RMSE that is allowed.
    resolution : int
        Width and height of the lightmap.
    samples : int
        Cycles' samples a texel in each reference. Its noise does not count as our error
        (`bench.error_measure`), but blurs how well that is known.
    needs : (major, minor)
        The first Blender that has the feature.
    """

    name: str
    family: str
    build: Callable[[], None]
    limit: float
    resolution: int
    samples: int
    needs: tuple[int, int]

    @property
    def title(self) -> str:
        """What the row shows: the first line of its builder's docstring."""
        return (self.build.__doc__ or self.name).strip().splitlines()[0].rstrip(".")

    @property
    def signature(self) -> str:
        """A hash of whatever the picture depends on: if it changes, references must be made anew."""
        parts = [self.resolution, self.samples, *sorted(_sources(self.build).items())]
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


ROWS: dict[str, Row] = {}


def row(
    name: str,
    *,
    limit: float = 0.03,
    resolution: int = 128,
    samples: int = 128,
    needs: tuple[int, int] = (4, 2),
) -> Callable[[Callable[[], None]], Callable[[], None]]:
    """Register a scene's builder as a row (see `Row`)."""

    def register(build: Callable[[], None]) -> Callable[[], None]:
        if name in ROWS:
            raise ValueError(f"there are two rows {name!r}")
        family = build.__module__.rpartition(".")[2]
        ROWS[name] = Row(name, family, build, limit, resolution, samples, needs)
        return build

    return register


def _sources(function: Callable[..., None], known: dict[str, str] | None = None) -> dict[str, str]:
    """Return the sources of a function and of all of this folder's that it uses, and the constants."""
    known = {} if known is None else known
    key = f"{function.__module__}.{function.__qualname__}"
    if key in known:
        return known
    known[key] = inspect.getsource(function)
    for name in _names(function.__code__):
        used = function.__globals__.get(name)
        if isinstance(used, FunctionType) and used.__module__.startswith(__name__):
            _sources(used, known)
        elif isinstance(used, int | float | str | tuple | dict):
            known[f"{function.__module__}.{name}"] = repr(used)
    return known


def _names(code: object) -> list[str]:
    """Return the global names in a function's code, in the functions within it too."""
    inner = [constant for constant in code.co_consts if inspect.iscode(constant)]
    return [*code.co_names, *(name for part in inner for name in _names(part))]


for _family in FAMILIES:
    importlib.import_module(f"{__name__}.{_family}")
