"""What all tests share: the scenes next to the checkout, and an end that Blender survives."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

SHARED_SCENES = Path(__file__).resolve().parents[2] / "shared" / "scenes"


@pytest.fixture(scope="session")
def shared_scenes() -> Path:
    """Folder of the scenes made by other people; skips where it is absent."""
    if not SHARED_SCENES.is_dir():
        pytest.skip(f"the shared scenes are not here ({SHARED_SCENES})")
    return SHARED_SCENES


@pytest.fixture(autouse=True)
def no_log_to_a_closed_stream() -> Iterator[None]:
    """Take away what Blender's glTF importer leaves behind when a file is damaged: it writes to the standard
    output of the test that ran then."""
    yield
    for name in ("glTFImporter", "glTFImporter_errors"):
        logging.getLogger(name).handlers.clear()


def pytest_configure() -> None:
    """Give each worker a core of its own: bakes that share all cores take a fifth longer."""
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker and hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        # Runs side by side start at different ones.
        number = int(worker.removeprefix("gw")) + int(os.environ.get("FIRST_CORE", "0"))
        os.sched_setaffinity(0, {cores[number % len(cores)]})


SLOW_TESTS = Path(__file__).parent / "slow_tests.txt"


def slow_tests() -> set[str]:
    """Return `FILE::FUNCTION` of all tests that `build.py test --quick` leaves out."""
    lines = SLOW_TESTS.read_text(encoding="utf-8").splitlines()
    return {line for line in lines if line and not line.startswith("#")}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of the list."""
    listed = slow_tests()
    for item in items:
        if item.nodeid.partition("[")[0] in listed:
            item.add_marker(pytest.mark.slow)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes() -> None:
    """Keep from workers what Blender's module has set in this process, if a folder's conftest.py imported it.

    5.2 sets OCIO behind Python's back: `os.environ` does not know it. Processes that find it set say so.
    """
    if "OCIO" not in os.environ:
        os.unsetenv("OCIO")


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session: pytest.Session) -> None:
    session.config.stash[_SESSION] = session


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """Leave without Python's own clean-up when Blender was imported.

    Interpreter exit with Blender callbacks registered segfaults in 4.2 and hangs in 4.5.
    This hook runs last: the summary, the junit file and the caches are written by then.
    """
    session = config.stash.get(_SESSION, None)
    if session is None or "bpy" not in sys.modules:
        return
    for stream in (sys.stdout, sys.stderr, sys.__stdout__, sys.__stderr__):
        if stream is not None:
            stream.flush()
    os._exit(int(session.exitstatus))


_SESSION = pytest.StashKey[pytest.Session]()
