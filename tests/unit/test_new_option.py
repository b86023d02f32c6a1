"""A new option takes at most three source files, and is on the command line, in scripts and on the page."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests import worked_example

FRONT_DOORS = """
import json
from build_tools.options_page import page
from radiosity_addon.base import UsageError
from radiosity_addon.cli import build_parser, requested_settings
from radiosity_addon.options import BakeSettings

def refused(read):
    try:
        read()
    except UsageError as error:
        return str(error)

def requested(*words):
    return requested_settings(build_parser("radiosity").parse_args(["bake", *words]))

(row,) = [line for line in page().splitlines() if line.startswith("| `--exposure STOPS`")]
print(json.dumps({
    "default": requested().exposure,
    "given": requested("--exposure", "-1.5").exposure,
    "in scripts": BakeSettings(exposure=2.0).exposure,
    "command line refuses": refused(lambda: requested("--exposure", "11")),
    "scripts refuse": refused(lambda: BakeSettings(exposure=11)),
    "page": row,
}))
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("copy")
    changed = worked_example.changed_copy(folder)
    assert 1 <= len(set(changed)) <= 3
    assert all(name.startswith("radiosity_addon/") for name in changed)
    return folder


def test_command_line_scripts_and_page_have_it(copy: Path) -> None:
    found = json.loads(worked_example.run(copy, "-c", FRONT_DOORS))
    assert (found["default"], found["given"], found["in scripts"]) == (0.0, -1.5, 2.0)
    for door in ("command line refuses", "scripts refuse"):
        assert "--exposure 11" in found[door]
        assert "between -10 and 10" in found[door]
    assert "*Exposure*" in found["page"]
    assert "between -10 and 10" in found["page"].lower()


def test_the_help_lists_it(copy: Path) -> None:
    code = (
        "from radiosity_addon.cli import build_parser; build_parser('radiosity').parse_args(['bake', '-h'])"
    )
    assert "--exposure STOPS" in worked_example.run(copy, "-c", code)


def test_its_own_test_passes(copy: Path) -> None:
    path = copy / "test_exposure.py"
    path.write_text(worked_example.example_test(), encoding="utf-8")
    output = worked_example.run(copy, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(path))
    assert "1 passed" in output
