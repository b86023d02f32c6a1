"""Words of the command line that no file or object can be called are refused before anything starts."""

from __future__ import annotations

from argparse import ArgumentTypeError
from pathlib import Path

import pytest

from radiosity_addon.blender.command_line.main import main
from radiosity_addon.cli.path_checks import (
    MAX_PATH,
    checked_folder,
    checked_name,
    checked_path,
    escaped,
    printable,
)
from radiosity_addon.options import OPTIONS, BakeSettings

MAX_SEED, MAX_THREADS = (int(OPTIONS[name].limits[1]) for name in ("seed", "threads"))

IMPOSSIBLE = [
    "",
    "a\0b",
    "\udcff",  # how Python shows a byte that is not UTF-8
    "~nobody-of-this-name/x",
    "x" * 256,
    "é" * 128,  # 256 bytes
    "/".join(["y" * 200] * 6),
]


@pytest.mark.parametrize("word", IMPOSSIBLE)
def test_impossible_paths_are_refused_and_named(word: str) -> None:
    for read in (checked_path, checked_folder):
        with pytest.raises(ArgumentTypeError) as caught:
            read(word)
        message = str(caught.value)
        assert "\n" not in message
        assert message.isprintable()
        assert len(message) < 200


def test_a_link_that_leads_to_itself_is_refused(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(ArgumentTypeError, match="link"):
        checked_path(str(tmp_path / "loop" / "scene.blend"))


@pytest.mark.parametrize(
    "word", ["scene.blend", "x" * 255, "é" * 127, "日本/シーン", "a b", "-", "..", "~/x"]
)
def test_what_files_can_be_called_is_taken(word: str) -> None:
    assert checked_path(word) == Path(word).expanduser()


def test_an_output_folder_leaves_room_for_the_names_of_its_files(tmp_path: Path) -> None:
    deep = str(tmp_path / "/".join(["d" * 99] * 8))
    assert len(deep) < MAX_PATH
    assert checked_path(deep) == Path(deep)
    with pytest.raises(ArgumentTypeError, match="shorter"):
        checked_folder(deep)


@pytest.mark.parametrize("word", ["", "a\0b", "\udcff"])
def test_impossible_names_are_refused(word: str) -> None:
    with pytest.raises(ArgumentTypeError):
        checked_name(word)
    assert checked_name("Wände 1") == "Wände 1"


@pytest.mark.parametrize("option", ["--output", "--report", "--plot", "--objects", "--ignore"])
@pytest.mark.parametrize("word", ["", "a\0b", "\udcff"])
def test_every_option_refuses_them_with_one_line(
    option: str, word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bake", "scene.blend", "--output", "o", option, word]) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert option in err


@pytest.mark.parametrize("word", IMPOSSIBLE)
@pytest.mark.parametrize("verb", ["bake", "restore"])
def test_a_scene_that_no_file_can_be_is_a_usage_error(
    verb: str, word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([verb, word, "--output", "o"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize(
    ("option", "value"),
    [("--seed", MAX_SEED + 1), ("--seed", -1), ("--seed", 10**30), ("--threads", MAX_THREADS + 1)]
    + [(option, value) for option in ("--seed", "--threads") for value in ("1.5", "nan", "inf", "")],
)
def test_numbers_that_blender_cannot_hold(
    option: str, value: object, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bake", "scene.blend", "--output", "o", option, str(value)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert option.strip("-") in err


def test_the_largest_seed_is_taken() -> None:
    assert BakeSettings(seed=MAX_SEED).seed == 2**31 - 1


def test_what_is_printed_cannot_steer_the_terminal() -> None:
    assert printable("a\nb  c") == "a b c"
    assert escaped("red \x1b[31m \udcff \0 é…") == "red \\x1b[31m \\udcff \\x00 é…"
