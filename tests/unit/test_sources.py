"""What neither a linter nor import-linter asks of the sources."""

from __future__ import annotations

import ast
from pathlib import Path

from tests.conftest import slow_tests

ROOT = Path(__file__).resolve().parents[2]
LONGEST_FILE = 400

WITH_PRIVATE_NAMES = {
    "tests/app/real_blender/inside/drive_live_view.py",
    "tests/app/real_blender/inside/drive_manners.py",
    "tests/app/real_blender/inside/drive_overlays.py",
    "tests/app/real_blender/inside/drive_relight.py",
    "tests/app/real_blender/inside/drive_undo.py",
    "tests/blender/test_cleaning.py",
    "tests/blender/test_file_watch.py",
    "tests/blender/test_live_relight.py",
    "tests/blender/test_scopes.py",
    "tests/blender/test_stand_in_edits.py",
    "tests/unit/test_interpolation.py",
}
"""Tests that still reach past what modules offer; no others may."""

NAMED_TUPLES = {"_replace", "_asdict", "_fields", "_make"}


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


def is_private(name: object) -> bool:
    return isinstance(name, str) and name.startswith("_") and not name.startswith("__")


def private_names(tree: ast.AST) -> list[str]:
    """Return the private names of others in a module: attributes, imports, and what is monkeypatched."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and is_private(node.attr):
            of_its_own = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls", "os")
            found += [] if of_its_own or node.attr in NAMED_TUPLES else [node.attr]
        if isinstance(node, ast.ImportFrom):
            found += [alias.name for alias in node.names if is_private(alias.name)]
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr == "setattr"
        ):
            names = [word.value for word in node.args if isinstance(word, ast.Constant)]
            found += [name for name in names if is_private(str(name).rpartition(".")[2])]
    return found


def test_tests_touch_no_private_names() -> None:
    """What is renamed within a module breaks no test."""
    with_some = set()
    for path in (ROOT / "tests").rglob("*.py"):
        if "fixtures" not in path.parts and private_names(ast.parse(path.read_text(encoding="utf-8"))):
            with_some.add(path.relative_to(ROOT).as_posix())
    assert with_some == WITH_PRIVATE_NAMES
