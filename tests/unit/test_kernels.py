"""Work over chunks of rows is given as functions of modules, so that other processes could run it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.numerics import fill_chunks

SOURCES = Path(radiosity_addon.__file__).parent
RUNNERS = ("map_chunks", "fill_chunks")


def assigned(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    """Yield each name and what it is set to, also of several names set at once."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                    pairs = zip(target.elts, node.value.elts, strict=True)
                    yield from ((ast.unparse(name), value) for name, value in pairs)
                else:
                    yield ast.unparse(target), node.value


def kernels(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the line and the function of each piece of work that is given to run over chunks."""
    named = list(assigned(tree))
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func) in RUNNERS:
            given = ast.unparse(node.args[0])
            for work in [value for name, value in named if name == given] or [node.args[0]]:
                is_partial = isinstance(work, ast.Call) and ast.unparse(work.func) == "partial"
                yield node.lineno, ast.unparse(work.args[0] if is_partial else work)  # type: ignore[attr-defined]


def test_kernels_are_functions_of_their_modules() -> None:
    found = 0
    for path in sorted(SOURCES.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        if path.name == "parallel.py" or not any(name in source for name in RUNNERS):
            continue
        tree = ast.parse(source)
        functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        for line, name in kernels(tree):
            assert name in functions, f"{path.relative_to(SOURCES)}:{line}: {name}"
            found += 1
    assert found > 20


@pytest.mark.parametrize("threads", [1, 3])
def test_results_of_chunks_fill_arrays_at_their_rows(threads: int) -> None:
    at = np.array([8, 1, 3, 5, 0])
    into = np.zeros(10), np.zeros((10, 2))
    fill_chunks(lambda rows: (at[rows] + 1.0, np.ones((1, 2))), into, len(at), 2, threads, at=at)
    np.testing.assert_array_equal(np.flatnonzero(into[0]), np.sort(at))
    np.testing.assert_array_equal(into[0][at], at + 1)
    assert into[1].sum() == 2 * len(at)


def test_results_that_are_one_array_fill_the_same_rows() -> None:
    into = np.zeros(5)
    fill_chunks(lambda rows: np.arange(rows.start, rows.stop), into, 5, 2, 1)
    np.testing.assert_array_equal(into, np.arange(5))
