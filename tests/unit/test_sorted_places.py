"""Places in sorted arrays are those of `np.searchsorted`, in whichever order they are asked for."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics import places_in, sorted_places


@pytest.mark.parametrize("dtype", [np.int32, np.int64, np.float64])
@pytest.mark.parametrize("long", [1, 10_000])
def test_they_are_the_leftmost(dtype: type, long: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sorted_places, "LONG", long)
    random = np.random.default_rng(1)
    ascending = np.sort(random.integers(0, 500, 1000)).astype(dtype)
    values = random.integers(-10, 510, 3000).astype(dtype)
    np.testing.assert_array_equal(places_in(ascending, values), np.searchsorted(ascending, values))


def test_nothing_is_found_in_nothing() -> None:
    assert len(places_in(np.zeros(0), np.zeros(0))) == 0
    np.testing.assert_array_equal(places_in(np.zeros(0), np.ones(2)), [0, 0])
