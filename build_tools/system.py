"""What the machine itself has to have: a Python with venv, and the libraries bpy links to."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys
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


def require_libraries() -> None:
    """Raise a BuildError that names the install command if bpy's libraries are not all there."""
    if not sys.platform.startswith("linux"):
        return
    missing = [library for library in DEBIAN_PACKAGE_OF_LIBRARY if not _loads(library)]
    if missing:
        packages = " ".join(DEBIAN_PACKAGE_OF_LIBRARY[library] for library in missing)
        raise BuildError(f"Blender's module needs {', '.join(missing)}; run: apt-get install -y {packages}")


def require_venv(python: str, version: tuple[int, int]) -> None:
    """Raise a BuildError that names the install command if `python` cannot make environments."""
    code = "import ensurepip, venv"
    if subprocess.run([python, "-c", code], capture_output=True, check=False).returncode != 0:
        package = f"python{version[0]}.{version[1]}-venv"
        raise BuildError(f"{python} has no working venv module; run: apt-get install -y {package}")


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


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
