"""The theory pages name functions, files and figures: all of them must exist."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
THEORY = ROOT / "docs" / "theory"
PAGES = sorted(THEORY.glob("*.md"))
FIGURES = ROOT / "docs" / "figures"
NOT_FIGURES = {"__main__", "drawing", "measures", "painting", "scenes"}

CODE = re.compile(r"`([^`\n]+)`")
DOTTED = re.compile(r"radiosity_addon(\.\w+)+")
PATH = re.compile(r"[\w./]+\.py")
FOLDER = re.compile(r"(?:[a-z_]+/)+")
MADE_BY_BUILDING = {"dist/", "out/"}
IMAGE = re.compile(r"!\[[^\]]*\]\(images/(\w+)\.png\)")
DISPLAYED = re.compile(r"\$\$(.+?)\$\$", re.DOTALL)
INLINE = re.compile(r"(?<![\\$\w])\$(?!\s)([^$]+?)(?<!\s)\$(?![\d$])")


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def codes(page: Path) -> list[str]:
    return CODE.findall(text_of(page))


def resolve(name: str) -> object:
    """Import as much of a dotted name as is a module, and look up the rest."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        try:
            found: object = importlib.import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[length:]:
            found = getattr(found, attribute)
        return found
    raise ModuleNotFoundError(name)


def test_there_is_a_page_for_every_section() -> None:
    sections = {page.stem.split("-")[0] for page in PAGES} - {"README", "city"}
    assert sections == {
        "1", "2.1", "2.2", "2.3", "3.1", "3.3", "3.4", "3.4.1", "3.4.2", "4.1", "4.2", "4.2.1"
    }  # fmt: skip
    index = text_of(THEORY / "README.md")
    assert [page.name for page in PAGES if page.name != "README.md" and f"({page.name})" not in index] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_name_of_the_code_exists(page: Path) -> None:
    for code in codes(page):
        if DOTTED.fullmatch(code):
            resolve(code)
        elif PATH.fullmatch(code) and "/" in code:
            assert (ROOT / code).is_file() or (ROOT / "radiosity_addon" / code).is_file(), code


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page.stem != "README"], ids=lambda page: page.stem
)
def test_every_page_ends_in_the_code(page: Path) -> None:
    _, _, last = text_of(page).rpartition("\n## ")
    assert last.startswith("In the code\n")
    assert any(DOTTED.fullmatch(code) for code in CODE.findall(last))


def test_a_name_that_does_not_exist_is_noticed() -> None:
    with pytest.raises(AttributeError):
        resolve("radiosity_addon.numerics.radiometry.no_such_function")
    with pytest.raises(AttributeError):
        resolve("radiosity_addon.solver.no_such_module.function")


def test_every_figure_is_shown_and_every_picture_is_made_by_a_script() -> None:
    scripts = {path.stem for path in FIGURES.glob("*.py")} - NOT_FIGURES
    shown = {name for page in PAGES for name in IMAGE.findall(text_of(page))}
    stored = {path.stem for path in (THEORY / "images").glob("*.png")}
    assert shown == scripts == stored


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_figure_is_explained_under_its_name(page: Path) -> None:
    text = text_of(page)
    for name in IMAGE.findall(text):
        assert re.search(rf"images/{name}\.png\)\n\n\*`{name}`", text), name
        caption = text.split(f"*`{name}`")[1].split("\n\n")[0]
        assert "sserted" in caption or "equal" in caption, name


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_formulas_read_on_a_git_host_too(page: Path) -> None:
    """Markdown takes a backslash before punctuation away, and a formula in a line ends with it."""
    text = re.sub(r"`[^`\n]*`", "", text_of(page))
    formulas = DISPLAYED.findall(text)
    in_lines = INLINE.findall(DISPLAYED.sub("", text))
    for formula in [*formulas, *in_lines]:
        assert not re.search(r"\\[^a-zA-Z]", formula), formula
        assert formula.count("{") == formula.count("}"), formula
    assert [formula for formula in in_lines if "\n" in formula] == []
    assert "$" not in INLINE.sub("", DISPLAYED.sub("", text))


DOCS = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "bench" / "README.md"]
FROM_HERE = ("", "radiosity_addon", "radiosity_addon/solver", "docs/figures", "bench", "tests/app")
PLACES = [ROOT / place for place in FROM_HERE]


@pytest.mark.parametrize("page", DOCS, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_file_that_the_docs_name_exists(page: Path) -> None:
    folders = ("radiosity_addon", "tests", "bench", "docs", "build_tools")
    names = {path.name for folder in folders for path in (ROOT / folder).rglob("*.py")} | {"build.py"}
    for code in codes(page):
        if PATH.fullmatch(code):
            known = code in names if "/" not in code else any((place / code).is_file() for place in PLACES)
            assert known, code
        elif FOLDER.fullmatch(code) and code not in MADE_BY_BUILDING:
            assert any((place / code).is_dir() for place in PLACES), code
