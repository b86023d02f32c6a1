"""A real Blender with the extension's own zip installed, made once for all these tests."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from build_tools import extension, real_blender
from build_tools.environments import Environment
from build_tools.real_blender import RealBlender
from tests.app.real_blender.installed import Installed

ROOT = Path(__file__).resolve().parents[3]

# Scripts that run in Blender, and what they share with the tests of the module.
SCRIPTS = [*(Path(__file__).parent / "inside").glob("*.py"), ROOT / "tests" / "blender" / "file_dump.py"]


@pytest.fixture(scope="session")
def blender() -> RealBlender:
    """A real Blender: CI always makes itself one, elsewhere the tests skip without."""
    found = real_blender.prepare() if os.environ.get("CI") else real_blender.find()
    if found is None:
        pytest.skip("no real Blender here; as root on Debian, `python3 build.py real-blender` installs one")
    return found


@pytest.fixture(scope="session")
def shared_folder(blender: RealBlender) -> Iterator[Path]:
    """A folder that Blender sees too."""
    with blender.shared_folder() as folder:
        yield folder


@pytest.fixture(scope="session")
def zips(shared_folder: Path) -> dict[str, Path]:
    """Platform → its zip, made from the sources as they are."""
    folder = shared_folder / "zips"
    made = extension.build(ROOT, Environment(ROOT, Path(sys.prefix)), folder)
    return dict(zip(extension.PIP_PLATFORMS, made, strict=True))


@pytest.fixture(scope="session")
def installed(blender: RealBlender, shared_folder: Path, zips: dict[str, Path]) -> Installed:
    """Blender as a user has it after `Install from Disk`."""
    folder = shared_folder / "installed"
    folder.mkdir()
    for script in SCRIPTS:
        shutil.copy(script, folder)
    made = Installed(blender, folder, folder / "user")
    made.resources.mkdir()
    install = ["--command", "extension", "install-file", "-r", "user_default", "-e", zips["linux-x64"]]
    done = made.run(*install)
    assert done.returncode == 0, done.stdout
    return made


@pytest.fixture(scope="session")
def cornell_blend(installed: Installed) -> Path:
    """The bundled Cornell box, saved as a .blend with small, quick bake settings."""
    path = installed.folder / "scene" / "cornell.blend"
    path.parent.mkdir()
    done = installed.script("save_cornell_box.py", path)
    assert done.returncode == 0, done.stdout
    return path
