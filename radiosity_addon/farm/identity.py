"""What must be the same for two processes to compute the same bytes."""

from __future__ import annotations

import hashlib
import importlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from .objects import ROOMS


@cache
def identity() -> dict[str, str]:
    """Return the program's code, its packages and the processor's instructions, by what each is called."""
    return {
        "version": _digest_of_code(),
        "Python": platform.python_version(),
        "NumPy": np.__version__,
        "embreex": version_of("embreex"),
        "instruction set": f"{platform.machine()} {' '.join(_instructions())}".strip(),
    }


def _digest_of_code() -> str:
    """Return a digest of all modules that the pipeline and its kernels are made of."""
    root = Path(__file__).resolve().parent.parent
    digest = hashlib.blake2b(digest_size=8)
    for room in (*ROOMS, "base", "options", "bake", "farm"):
        for path in sorted((root / room).rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def version_of(package: str) -> str:
    """Return the version of a package that is installed; "none" if it is not."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def _instructions() -> list[str]:
    """Return the instruction sets that NumPy uses here: its loops may round otherwise with others."""
    newer = np.__version__.split(".")[0] != "1"
    core = importlib.import_module(f"numpy.{'_core' if newer else 'core'}._multiarray_umath")
    features: dict[str, bool] = core.__cpu_features__
    return sorted(name for name, there in features.items() if there)
