"""What the tests of the installed extension talk to."""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from build_tools.real_blender import RealBlender


@dataclass(frozen=True)
class Installed:
    """A Blender with the extension installed and enabled in a user folder of its own."""

    blender: RealBlender
    folder: Path
    resources: Path

    def run(self, *arguments: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
        """Run Blender; paths become the ones it knows."""
        words = [self.blender.inside(word) if isinstance(word, Path) else word for word in arguments]
        return self.blender.run(*words, resources=self.resources, **options)

    def script(self, name: str, *arguments: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
        """Run a script of `inside/` in the background; an exception in it is an exit code."""
        return self.run(
            "-b", "--python-exit-code", "3", "--python", self.folder / name, "--", *arguments, **options
        )

    def answer(self, name: str, *arguments: str | Path, **options: Any) -> Any:
        """Run a script of `inside/` that writes JSON to its first argument and return that."""
        path = self.folder / f"{Path(name).stem}.json"
        path.unlink(missing_ok=True)
        done = self.script(name, path, *arguments, **options)
        assert done.returncode == 0, done.stdout
        return json.loads(path.read_text())
