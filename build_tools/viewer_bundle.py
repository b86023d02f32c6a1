"""The viewer's program, bundled with three.js into one file of the extension; its output is committed.

npm's packages are pinned in `build_tools/viewer` with their digests, and installed in `.envs/viewer`.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
from pathlib import Path

from .errors import BuildError

SOURCE = Path("build_tools/viewer")
ASSETS = Path("radiosity_addon/exports/assets/viewer")
BUNDLED = ("three",)
"""Packages whose code is in the bundle."""


def node_packages(root: Path) -> Path:
    """Return the folder `node_modules` of the pinned packages, installed if they are not.

    Raises BuildError without Node.js, or if npm fails.
    """
    npm = shutil.which("npm")
    if npm is None:
        raise BuildError(
            "npm is missing: install Node.js 20 or later (Debian: apt-get install -y nodejs npm)"
        )
    place = root / ".envs" / "viewer"
    lock = (root / SOURCE / "package-lock.json").read_bytes()
    stamp, wanted = place / "installed", hashlib.sha256(lock).hexdigest()
    if not stamp.is_file() or stamp.read_text() != wanted:
        place.mkdir(parents=True, exist_ok=True)
        for name in ("package.json", "package-lock.json"):
            shutil.copy(root / SOURCE / name, place / name)
        done = subprocess.run([npm, "ci", "--no-audit", "--no-fund"], cwd=place, check=False)
        if done.returncode:
            raise BuildError("npm could not install the viewer's packages")
        stamp.write_text(wanted)
    return place / "node_modules"


def bundle(root: Path, target: Path, source: Path | None = None) -> None:
    """Write viewer.js, or another program of ours, as one script for browsers."""
    packages = node_packages(root)
    command = [packages / "esbuild" / "bin" / "esbuild", source or root / SOURCE / "viewer.js"]
    options = ["--bundle", "--minify", "--format=iife", "--target=es2022", "--legal-comments=none"]
    environment = {**os.environ, "NODE_PATH": str(packages)}
    done = subprocess.run(
        [*command, *options, "--log-level=warning", f"--outfile={target}"], env=environment, check=False
    )
    if done.returncode:
        raise BuildError("esbuild could not bundle the program")


def write_viewer(root: Path) -> None:
    """Bundle the viewer into the extension, with the licenses of what is in it."""
    bundle(root, root / ASSETS / "viewer.js")
    packages = node_packages(root)
    texts = [f"{name}\n\n{(packages / name / 'LICENSE').read_text('utf-8')}" for name in BUNDLED]
    zstd = "zstd (in three.js: examples/jsm/libs/zstddec.module.js, MIT; Zstandard itself BSD-3-Clause)\n"
    (root / ASSETS / "LICENSES.txt").write_text("\n\n".join([*texts, zstd]), encoding="utf-8")
