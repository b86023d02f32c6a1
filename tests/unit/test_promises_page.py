"""Each sentence of docs/promises.md names tests that exist."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "promises.md"

ITEM = re.compile(r"^- (.+?)(?=\n- |\n\n|\n#|\Z)", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")

PROMISES = ITEM.findall(PAGE.read_text(encoding="utf-8"))


def sentence_of(promise: str) -> str:
    return " ".join(NAMED.sub("", promise).split()).rstrip(" ,")


def test_there_are_promises() -> None:
    assert len(PROMISES) > 20
    assert all(sentence_of(promise).endswith(".") for promise in PROMISES)


@pytest.mark.parametrize("promise", PROMISES, ids=sentence_of)
def test_a_test_backs_it(promise: str) -> None:
    named = NAMED.findall(promise)
    assert named, "no test is named"
    for path, name in named:
        functions = [node.name for node in ast.walk(ast.parse((ROOT / path).read_text(encoding="utf-8")))
                     if isinstance(node, ast.FunctionDef)]  # fmt: skip
        assert name in functions, f"{path} has no {name}"


@pytest.mark.parametrize(
    "path", ["tests/blender/test_promises.py", "tests/blender/test_promises_of_scenes.py"]
)
def test_every_promise_test_is_named(path: str) -> None:
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    functions = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    tests = {name for name in functions if name.startswith("test_")}
    assert tests == {name for promise in PROMISES for file, name in NAMED.findall(promise) if file == path}
