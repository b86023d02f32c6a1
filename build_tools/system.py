"""What the machine itself has to have: a Python with venv, and the libraries bpy links to."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from .errors import BuildError

# What `import bpy` loads from the system, by Debian's package of the same name in 12 and 13.
DEBIAN_PACKAGE_OF_LIBRARY = {
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXrender.so.1": "libxrender1",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
    "libGL.so.1": "libgl1",
}


def require(python: str | None, version: tuple[int, int], with_blender: bool = True) -> None:
    """Raise a BuildError that names everything missing, and the one command that installs it.

    Parameters
    ----------
    python : the interpreter to make an environment with, None if there is one already
    version : its version
    with_blender : whether bpy is to run, which links to the libraries
    """
    needed = with_blender and sys.platform.startswith("linux")
    missing = dict(DEBIAN_PACKAGE_OF_LIBRARY) if needed else {}
    missing = {library: package for library, package in missing.items() if not _loads(library)}
    if python is not None and not _makes_environments(python):
        missing[f"the venv module of {python}"] = f"python{version[0]}.{version[1]}-venv"
    if missing:
        command = f"apt-get install -y {' '.join(missing.values())}"
        raise BuildError(f"this machine lacks {', '.join(missing)}; on Debian run: {command}")


def find_python(version: tuple[int, int]) -> str:
    """Path of an interpreter of that version: the running one, one on PATH, or pyenv's."""
    name = f"python{version[0]}.{version[1]}"
    pyenv = Path.home() / ".pyenv" / "versions"
    candidates = [sys.executable, shutil.which(name), f"/usr/bin/{name}"]
    candidates += sorted(str(path) for path in pyenv.glob(f"{version[0]}.{version[1]}.*/bin/python"))
    for python in filter(None, candidates):
        if version_of(python) == version:
            return python
    raise BuildError(f"no {name} found; install it (Debian: apt-get install -y {name} {name}-venv, or pyenv)")


def newest_python(versions: Iterable[tuple[int, int]]) -> tuple[int, int]:
    """Return the newest of these versions that is here and makes environments; else the running one."""
    for version in sorted(versions, reverse=True):
        with suppress(BuildError):
            if _makes_environments(find_python(version)):
                return version
    return sys.version_info[:2]


def version_of(python: str) -> tuple[int, int] | None:
    """An interpreter's version, None if it does not run (as a pyenv shim that is not active)."""
    code = "import sys; print(*sys.version_info[:2])"
    try:
        answer = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False)
    except OSError:
        return None
    if answer.returncode != 0:
        return None
    major, minor = answer.stdout.split()
    return int(major), int(minor)


def _makes_environments(python: str) -> bool:
    # Debian ships venv without ensurepip, in a package apart.
    done = subprocess.run([python, "-c", "import ensurepip, venv"], capture_output=True, check=False)
    return done.returncode == 0


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
