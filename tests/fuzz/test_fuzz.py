"""Five hundred random scenes: no crash, no NaN, no light from nothing, and restored exactly."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip("bpy")

import radiosity_addon

from .checks import check

SCENES, CHUNK = 500, 25


@pytest.fixture(scope="module", autouse=True)
def registered() -> Iterator[None]:
    radiosity_addon.register()
    yield
    radiosity_addon.unregister()


@pytest.mark.parametrize("first", range(0, SCENES, CHUNK))
def test_random_scenes(first: int) -> None:
    baked, wrong = 0, []
    for seed in range(first, first + CHUNK):
        try:
            baked += check(seed)
        except Exception as error:  # noqa: BLE001 (all seeds are told, not only the first)
            wrong.append(f"seed {seed}: {type(error).__name__}: {error}")
    assert wrong == []
    # The generator is of no use if most of its scenes are refused.
    assert baked >= 0.6 * CHUNK
