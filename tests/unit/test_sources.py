"""What neither a linter nor import-linter asks of the sources."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.conftest import slow_tests

ROOT = Path(__file__).resolve().parents[2]
LONGEST_FILE = 400

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


NAMED_BY_A_STRING = {"setattr", "getattr", "hasattr", "delattr", "patch"}


def private_names(tree: ast.AST) -> list[str]:
    """Return the private names of others in a module: attributes, imports, and what strings name."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and is_private(node.attr):
            of_its_own = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls", "os")
            found += [] if of_its_own or node.attr in NAMED_TUPLES else [node.attr]
        if isinstance(node, ast.Import | ast.ImportFrom):
            found += [alias.name for alias in node.names if is_private(alias.name.rpartition(".")[2])]
        if isinstance(node, ast.Call):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            words = [word.value for word in node.args if isinstance(word, ast.Constant)]
            if called in NAMED_BY_A_STRING:
                found += [name for name in words if is_private(str(name).rpartition(".")[2])]
    return found


@pytest.mark.parametrize(
    "source",
    [
        "room._door",
        "room.make()._door",
        "from house import _room",
        "import house._room",
        "monkeypatch.setattr(room, '_door', None)",
        "monkeypatch.setattr('house.room._door', None)",
        "getattr(room, '_door')",
    ],
)
def test_private_names_are_found_however_they_are_reached(source: str) -> None:
    assert private_names(ast.parse(source))


def test_tests_touch_no_private_names() -> None:
    """What is renamed within a module breaks no test."""
    found = {
        path.relative_to(ROOT).as_posix(): names
        for path in (ROOT / "tests").rglob("*.py")
        if "fixtures" not in path.parts and (names := private_names(ast.parse(path.read_text("utf-8"))))
    }
    assert found == {}
