"""Sidecars that were changed by hand, their digest made right again: refused in a line, or harmless."""

from __future__ import annotations

import copy
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake_and_keep
from radiosity_addon.bake.relight.kept_bake import relight_pages
from radiosity_addon.bake.sidecar.sidecar import FORMAT, MAGIC, read_sidecar, write_sidecar
from radiosity_addon.base.errors import RadiosityError, SceneError
from radiosity_addon.numerics.array_file import read_arrays, write_arrays
from radiosity_addon.options.bake_settings import BakeSettings
from tests.relit_rooms import CHANGED, lit_bake

Array = np.ndarray[Any, Any]

SETTINGS = BakeSettings(resolution=8, quality="draft", threads=1)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, list[Array]]:
    """What a sidecar holds."""
    path = tmp_path_factory.mktemp("whole") / "lightmap.relight"
    result, kept = bake_and_keep(lit_bake(), SETTINGS)
    write_sidecar(path, kept, result, "mark")
    return read_arrays(path, MAGIC, FORMAT)


def outcome(path: Path, told: Any, arrays: list[Array]) -> str:
    """Relight from a sidecar of these contents; return why it is refused, "" if it is not."""
    write_arrays(path, MAGIC, FORMAT, told, arrays)
    scene = lit_bake(CHANGED)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numbers that overflow
            stored = read_sidecar(path)
            pages = relight_pages(stored.kept(scene), CHANGED)
            stored.result(scene, pages, error=0.1)
    except SceneError as error:
        return f"{path} is of another scene: {error}"
    except RadiosityError as error:
        return str(error)
    for page in pages:
        assert np.isfinite(page.pixels).all()
        assert (page.pixels >= 0.0).all()
    return ""


def at_the_middle(value: float) -> Callable[[Array], Array]:
    """Set one number of an array."""

    def change(array: Array) -> Array:
        changed = array.copy()
        with np.errstate(all="ignore"):
            changed.reshape(-1)[array.size // 2] = np.array(value).astype(array.dtype)
        return changed

    return change


CHANGES: dict[str, Callable[[Array], Array]] = {
    "nan": at_the_middle(np.nan),
    "infinite": at_the_middle(np.inf),
    "one below 0": at_the_middle(-1),
    "far below 0": at_the_middle(-1e9),
    "huge": at_the_middle(2**31 - 1),
    "all huge": lambda array: np.full(array.shape, 1e30 if array.dtype.kind == "f" else 2**31 - 1).astype(
        array.dtype
    ),
    "all 0": np.zeros_like,
    "other type": lambda array: array.astype("float64" if array.dtype.kind in "ib" else "int64"),
    "unsigned": lambda array: array.astype("uint8"),
    "cut off": lambda array: array[:-1],
    "longer": lambda array: np.concatenate([array, array[-1:]]),
    "flat": lambda array: array.reshape(-1, 1, 1),
    "empty": lambda array: array[:0],
    "backwards": lambda array: np.ascontiguousarray(array[::-1]),
}


NEVER_HARMLESS = {"nan", "infinite", "other type", "cut off", "longer", "flat", "all huge"}


@pytest.mark.parametrize("name", list(CHANGES))
def test_every_array_may_be_damaged(whole: tuple[Any, list[Array]], tmp_path: Path, name: str) -> None:
    """Nothing but a named error, or light that is finite and not negative, comes of it."""
    told, arrays = whole
    path, refused, tried = tmp_path / "lightmap.relight", 0, 0
    likely = name in ("nan", "one below 0", "huge")
    for number, array in enumerate(arrays):
        # Of the likeliest changes each array gets every other one, of the rest one in seven.
        if not array.size or (number + list(CHANGES).index(name)) % (2 if likely else 7):
            continue
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            damaged = CHANGES[name](array)
        if damaged.dtype == array.dtype and np.array_equal(damaged, array):
            continue
        tried += 1
        message = outcome(path, told, [*arrays[:number], damaged, *arrays[number + 1 :]])
        assert "\n" not in message
        if message:
            refused += 1
            assert str(path) in message, (number, array.dtype, array.shape, message)
        elif array.dtype.kind == "f":
            # No number that is not finite, negative where it may not be, or absurd passes unseen.
            assert name not in NEVER_HARMLESS, number
    assert refused > 0.1 * tried


def leaves(node: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield where in a description plain values are."""
    if isinstance(node, dict):
        for key, item in node.items():
            yield from leaves(item, (*at, key))
    elif isinstance(node, list):
        for number, item in enumerate(node):
            yield from leaves(item, (*at, number))
    else:
        yield at


def put(told: Any, at: tuple[Any, ...], value: Any) -> Any:
    """Return a description with another value somewhere."""
    changed = copy.deepcopy(told)
    owner = changed
    for key in at[:-1]:
        owner = owner[key]
    owner[at[-1]] = value
    return changed


@pytest.mark.parametrize(
    "value",
    [None, -1, 2**40, 0, 1, 1e30, float("nan"), "text", [], {}, {"object": ["Links", {}]}, {"array": 0}],
    ids=repr,
)
def test_every_value_of_the_description_may_be_damaged(
    whole: tuple[Any, list[Array]], tmp_path: Path, value: Any
) -> None:
    told, arrays = whole
    path, refused = tmp_path / "lightmap.relight", 0
    places = list(leaves(told))
    # One in forty, others for each value.
    for at in places[len(repr(value)) % 40 :: 40]:
        message = outcome(path, put(told, at, value), arrays)
        assert "\n" not in message
        refused += bool(message)
    assert refused


def test_what_belongs_to_no_sidecar_is_refused(whole: tuple[Any, list[Array]], tmp_path: Path) -> None:
    told, arrays = whole
    path = tmp_path / "lightmap.relight"
    assert outcome(path, told, arrays) == ""
    for wrong in (
        {},
        [],
        None,
        {"dict": 1},
        {"dict": told["dict"][:3]},
        {"object": ["LightGains", {"count": 0}]},
        {"object": ["object", {}]},
    ):
        assert str(path) in outcome(path, wrong, arrays)
    deep: Any = None
    for _ in range(400):
        deep = {"list": [deep]}
    assert str(path) in outcome(path, deep, arrays)
