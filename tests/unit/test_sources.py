"""What neither a linter nor import-linter asks of the sources."""

from __future__ import annotations

import ast
from pathlib import Path

from tests.conftest import slow_tests

ROOT = Path(__file__).resolve().parents[2]
LONGEST_FILE = 400


def test_files_stay_short() -> None:
    files = [ROOT / "build.py"]
    for folder in ("radiosity_addon", "build_tools", "tests"):
        files += [path for path in (ROOT / folder).rglob("*.py") if "fixtures" not in path.parts]
    lines = {str(path): len(path.read_text(encoding="utf-8").splitlines()) for path in files}
    assert {name: count for name, count in lines.items() if count > LONGEST_FILE} == {}


def test_own_modules_are_imported_relatively() -> None:
    """An installed extension's package is not called radiosity_addon."""
    absolute = []
    for path in (ROOT / "radiosity_addon").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module or ""]
            absolute += [f"{path}:{node.lineno}" for name in names if name.split(".")[0] == "radiosity_addon"]
    assert absolute == []


def test_slow_tests_that_are_listed_exist() -> None:
    for name in slow_tests():
        path, _, function = name.partition("::")
        assert f"def {function}(" in (ROOT / path).read_text(encoding="utf-8"), name
