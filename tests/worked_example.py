"""Apply the worked example of CONTRIBUTING.md, a new option, to a copy of the code."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

DIFF = re.compile(r"^```diff\n--- (\S+)\n@@\n(.*?)^```$", re.MULTILINE | re.DOTALL)
TEST = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def example() -> str:
    """Return the text of the worked example."""
    return (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split("## A worked example")[1]


def changed_copy(folder: Path) -> list[str]:
    """Copy the code to a folder, change it as the example says, and return the names of the files changed."""
    for name in ("radiosity_addon", "build_tools"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    changed = []
    for name, lines in DIFF.findall(example()):
        before, after = (_without(lines, sign) for sign in "+-")
        text = (folder / name).read_text(encoding="utf-8")
        assert text.count(before) == 1, f"{name} is not as CONTRIBUTING.md has it"
        (folder / name).write_text(text.replace(before, after), encoding="utf-8")
        changed.append(name)
    return changed


def example_test() -> str:
    """Return the test that the example adds."""
    (test,) = TEST.findall(example())
    return test


def run(folder: Path, *arguments: str) -> str:
    """Run Python on the changed copy and return its output; tests' helpers come from here."""
    path = os.pathsep.join((str(folder), str(ROOT)))
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def _without(lines: str, sign: str) -> str:
    """Return one side of a diff: what does not begin with the sign."""
    kept = (line for line in lines.splitlines(keepends=True) if not line.startswith(sign))
    return "".join(line if line == "\n" else line[1:] for line in kept)
