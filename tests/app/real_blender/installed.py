"""What the tests of the installed extension talk to."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from build_tools.real_blender import RealBlender

PICTURES = Path(__file__).resolve().parents[3] / "out" / "ci"
"""Where photographs of windows, and what their sessions saw, stay for the eye."""

WINDOW_TIMEOUT = 1200
"""Seconds until a session in a window is ended."""


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

    def drive(
        self, name: str, scene: Path, session: str, *words: str, size: tuple[str, str] = ("1280", "800")
    ) -> dict[str, Any]:
        """Open a scene in a window that a script of `inside/` drives, and return what it saw.

        session: Begins the names of the script's answer and pictures, which are beside the scene.
        words: Go to the script.
        size: Of the window [pixels].
        """
        answer = scene.with_name(f"{session}.json")
        answer.unlink(missing_ok=True)
        command = [scene, "--enable-event-simulate", "--window-geometry", "0", "0", *size]
        command += ["--python", self.folder / name, "--", answer, *words]
        done = self.run(*command, window=True, timeout=WINDOW_TIMEOUT)
        PICTURES.mkdir(parents=True, exist_ok=True)
        for picture in PICTURES.glob(f"{session}*.png"):
            picture.unlink()
        for picture in scene.parent.glob(f"{session}*.png"):
            shutil.copy(picture, PICTURES)
        assert answer.exists(), done.stdout
        seen: dict[str, Any] = json.loads(answer.read_text())
        (PICTURES / answer.name).write_text(json.dumps(seen, indent=1) + done.stdout)
        assert seen["failure"] is None, f"{seen['failure']}\n{done.stdout}"
        assert "Traceback" not in done.stdout, done.stdout
        return seen
