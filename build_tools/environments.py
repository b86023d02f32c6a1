"""Virtual environments with pinned packages: made once, brought up to date when the pins change."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from . import system
from .errors import BuildError

# Each bpy release is built for one Python.
PYTHON_OF_BPY = {"4.2": (3, 11), "5.0": (3, 11), "5.2": (3, 13)}
BPY_OF_PYTHON = {(3, 11): "5.0", (3, 13): "5.2"}


@dataclass(frozen=True)
class Environment:
    """A virtual environment that is known to hold the pinned packages.

    Parameters
    ----------
    root : the checkout, which commands import the project from
    folder : the virtual environment
    more_paths : folders of further packages, which it imports too
    """

    root: Path
    folder: Path
    more_paths: tuple[Path, ...] = ()

    @property
    def python(self) -> Path:
        """The environment's interpreter."""
        return _interpreter(self.folder)

    def run(self, *arguments: str) -> int:
        """Run the interpreter and return its exit code."""
        return subprocess.run([str(self.python), *arguments], env=self._variables(), check=False).returncode

    def hand_over(self, *arguments: str) -> int:
        """Become the interpreter, so that signals and exit codes are its own; returns only on Windows."""
        sys.stdout.flush()
        if os.name != "nt":
            os.execve(str(self.python), [str(self.python), *arguments], self._variables())
        return self.run(*arguments)

    def _variables(self) -> dict[str, str]:
        paths = [str(self.root), *map(str, self.more_paths), *filter(None, [os.environ.get("PYTHONPATH")])]
        return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def main_environment(root: Path) -> Environment:
    """`.venv` with the bpy for its Python, the one it was made with, else the caller's; and with Dask."""
    folder = root / ".venv"
    python = _python_version(folder) or sys.version_info[:2]
    if python not in BPY_OF_PYTHON:
        made_with = f"{python[0]}.{python[1]}"
        raise BuildError(f"{folder} was made with Python {made_with}; delete it and run this again")
    return _with_bpy(root, folder, BPY_OF_PYTHON[python], "dask")


def bpy_environment(root: Path, bpy: str) -> Environment:
    """`.envs/bpy-VERSION`, whose Python may be another than the caller's."""
    if bpy not in PYTHON_OF_BPY:
        raise BuildError(f"no pins for bpy {bpy}; there are {', '.join(PYTHON_OF_BPY)}")
    return _with_bpy(root, root / ".envs" / f"bpy-{bpy}", bpy)


def quick_environment(root: Path) -> Environment:
    """`.envs/quick`, which runs the tests that need neither bpy nor a window.

    Its Python is the newest that is here, and NumPy with it: the main environment may have older ones.
    """
    folder = root / ".envs" / "quick"
    version = _python_version(folder) or system.newest_python(BPY_OF_PYTHON)
    return _ready(root, folder, [root / "requirements" / "quick.txt"], version, with_blender=False)


def docs_environment(root: Path) -> Environment:
    """`.envs/docs`, which draws the figures and builds the site: the solver's packages, but no bpy."""
    folder = root / ".envs" / "docs"
    version = _python_version(folder) or sys.version_info[:2]
    return _ready(root, folder, [root / "requirements" / "docs.txt"], version, with_blender=False)


def bench_environment(root: Path) -> Environment:
    """The main environment, and next to it in `.envs/bench` what only the benchmarks need."""
    main = main_environment(root)
    pins, folder = root / "requirements" / "bench.txt", root / ".envs" / "bench"
    stamp = folder / "pins.sha256"
    wanted = hashlib.sha256(pins.read_bytes() + str(_python_version(main.folder)).encode()).hexdigest()
    if not stamp.is_file() or stamp.read_text() != wanted:
        shutil.rmtree(folder, ignore_errors=True)
        # Their own dependencies would bring another NumPy than Blender's.
        install(main.folder, [pins], "--no-deps", "--target", str(folder))
        stamp.write_text(wanted)
    return Environment(root, main.folder, (folder,))


def _with_bpy(root: Path, folder: Path, bpy: str, *more: str) -> Environment:
    pins = [root / "requirements" / f"{name}.txt" for name in (f"bpy-{bpy}", "tools", *more)]
    return _ready(root, folder, pins, PYTHON_OF_BPY[bpy], with_blender=True)


def _ready(
    root: Path, folder: Path, pins: list[Path], version: tuple[int, int], with_blender: bool
) -> Environment:
    """Make or update the environment unless its stamp says that it holds these very pins."""
    stamp = folder / "pins.sha256"
    wanted = hashlib.sha256(b"".join(path.read_bytes() for path in pins)).hexdigest()
    if _works(folder):
        system.require(None, version, with_blender)
        if stamp.is_file() and stamp.read_text() == wanted:
            return Environment(root, folder)
    else:
        python = system.find_python(version)
        system.require(python, version, with_blender)
        create(folder, python)
    install(folder, pins)
    # Last, so that an interrupted installation is taken up again by the next call.
    stamp.write_text(wanted)
    return Environment(root, folder)


def create(folder: Path, python: str) -> None:
    """Make a virtual environment; one that is there is replaced."""
    print(f"making {folder} with {python}", file=sys.stderr, flush=True)
    if subprocess.run([python, "-m", "venv", "--clear", str(folder)], check=False).returncode != 0:
        raise BuildError(f"{python} could not make {folder} (its message is above); fix that and run again")


def install(folder: Path, pins: list[Path], *how: str) -> None:
    """Install the packages of files of pins; `how` goes to pip."""
    names = " and ".join(path.name for path in pins)
    size = "1 GB" if any(path.name.startswith("bpy") for path in pins) else "up to 250 MB"
    print(f"installing the pinned packages of {names}, about {size}", file=sys.stderr, flush=True)
    command = [str(_interpreter(folder)), "-m", "pip", "install", "--disable-pip-version-check"]
    command += ["--no-input", *how]
    command += [] if sys.stderr.isatty() else ["-qq"]
    command += [word for path in pins for word in ("-r", str(path))]
    # What pip says belongs to the set-up, not to the verb's own output.
    if subprocess.run(command, stdout=sys.stderr, check=False).returncode != 0:
        raise BuildError(f"pip could not install {names} (its message is above); fix that and run again")


def _works(folder: Path) -> bool:
    """Whether the environment's own Python starts and has pip: a half-made one does not."""
    try:
        command = [str(_interpreter(folder)), "-c", "import pip"]
        done = subprocess.run(command, capture_output=True, check=False)
    except OSError:
        return False
    return done.returncode == 0


def _python_version(folder: Path) -> tuple[int, int] | None:
    """The Python a virtual environment was made with, None if there is no whole one."""
    if not _works(folder):
        return None
    return system.version_of(str(_interpreter(folder)))


def _interpreter(folder: Path) -> Path:
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
