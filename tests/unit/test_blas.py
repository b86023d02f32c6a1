"""NumPy's OpenBLAS works on one thread within `one_blas_thread`, and as before after it."""

from __future__ import annotations

from threading import Barrier, Thread

import pytest

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.base.progress import Progress
from radiosity_addon.numerics import blas, one_blas_thread
from radiosity_addon.options import BakeSettings
from tests.rooms import box_room, gray_scene
from tests.unit.texel_scenes import bake_scene


@pytest.fixture
def threads():
    """What gets and what sets the number of threads, which is 3 during the test."""
    functions = blas.thread_functions()
    if functions is None:
        pytest.skip("NumPy is not linked to OpenBLAS here")
    before = functions[0]()
    functions[1](3)
    yield functions
    functions[1](before)


def test_nested_and_after_an_error_the_number_is_restored(threads) -> None:
    get, _ = threads

    def fail() -> None:
        with one_blas_thread():
            with one_blas_thread():
                assert get() == 1
            assert get() == 1
            raise ValueError("within")

    with pytest.raises(ValueError, match="within"):
        fail()
    assert get() == 3


def test_it_lasts_until_the_last_of_several_threads_leaves(threads) -> None:
    get, _ = threads
    first_left = Barrier(2)

    def second() -> None:
        with one_blas_thread():
            first_left.wait()
            first_left.wait()
            assert get() == 1

    with one_blas_thread():
        other = Thread(target=second)
        other.start()
        first_left.wait()
    assert get() == 1
    first_left.wait()
    other.join()
    assert get() == 3


def test_other_librarys_names_change_nothing(monkeypatch: pytest.MonkeyPatch, threads) -> None:
    get, _ = threads
    monkeypatch.setattr(blas, "NAMES", ("no_such_{}",))
    blas.thread_functions.cache_clear()
    try:
        with one_blas_thread():
            assert get() == 3
    finally:
        blas.thread_functions.cache_clear()


def test_a_bake_has_one(threads) -> None:
    get, _ = threads
    seen = []
    triangles, _ = box_room()
    scene = bake_scene(gray_scene(triangles, 0.5, 1.0), ("Room", 12))
    bake(scene, BakeSettings(resolution=16, quality="sketch"), Progress(lambda _: seen.append(get())))
    assert set(seen) == {1}
    assert get() == 3
