"""Paths and names on the command line; impossible ones are refused at once."""

from __future__ import annotations

import os
from argparse import ArgumentTypeError
from pathlib import Path

from ..base import BakeError

MAX_NAME = 255
"""Bytes of a file's or folder's name that file systems allow."""

MAX_PATH = 1023
"""Bytes of a path that Blender can hold."""

OWN_NAMES = 310
"""Bytes that the names of our own files take inside an output folder, the hidden folder included."""

SHOWN = 60
"""Characters of a refused word that are repeated in the error."""


def checked_path(word: str) -> Path:
    """Return the path that a word names, `~` expanded.

    Raises ArgumentTypeError if no file can have this path.
    """
    shown = quoted(word)
    _check_text(word, "path")
    try:
        path = Path(word).expanduser()
        length = len(os.fsencode(path.absolute()))
        os.path.realpath(path, strict=True)
    except (FileNotFoundError, NotADirectoryError):
        pass  # what need not be there yet, and where a folder can be made, is known later
    except RuntimeError:
        raise ArgumentTypeError(f"{shown}: there is no such user; give another path") from None
    except OSError as error:  # a link that leads to itself
        raise ArgumentTypeError(f"{shown}: {error.strerror}; give another path") from None
    if any(len(os.fsencode(part)) > MAX_NAME for part in path.parts):
        raise ArgumentTypeError(f"{shown}: a name in it is longer than {MAX_NAME} bytes; give a shorter one")
    if length > MAX_PATH:
        raise ArgumentTypeError(f"{shown} is longer than {MAX_PATH} bytes; give a shorter path")
    return path


def checked_folder(word: str) -> Path:
    """Return the path of an output folder that a word names; our files in it must have paths too.

    Raises ArgumentTypeError if no folder can have this path.
    """
    path = checked_path(word)
    if len(os.fsencode(path.absolute())) > MAX_PATH - OWN_NAMES:
        raise ArgumentTypeError(
            f"{quoted(word)} is longer than {MAX_PATH - OWN_NAMES} bytes; give a shorter path"
        )
    return path


def check_folder(path: Path) -> None:
    """Refuse a path that no output folder can have, wherever it comes from.

    Raises BakeError.
    """
    try:
        checked_folder(str(path))
    except ArgumentTypeError as error:
        raise BakeError(f"cannot write to the output folder {error}") from error


def checked_name(word: str) -> str:
    """Return a word that names an object, a lamp, a material or a light group.

    Raises ArgumentTypeError if nothing can have this name.
    """
    _check_text(word, "name")
    return word


def quoted(word: str) -> str:
    """Return a word as an error shows it: shortened, and safe to print."""
    return repr(word if len(word) <= SHOWN else f"{word[: SHOWN - 1]}…")


def printable(text: str) -> str:
    """Return a text on one line that is safe to print."""
    return escaped(" ".join(text.split()))


def escaped(line: str) -> str:
    """Return a line with what a terminal cannot show, or would obey, escaped."""
    return "".join(each if each.isprintable() else ascii(each)[1:-1] for each in line)


def _check_text(word: str, what: str) -> None:
    """Refuse words that are empty, contain a NUL or are not UTF-8."""
    if not word:
        raise ArgumentTypeError(f"the {what} is empty")
    if "\0" in word:
        raise ArgumentTypeError(f"{quoted(word)}: a {what} cannot hold a NUL character")
    try:
        word.encode()
    except UnicodeEncodeError:
        # Blender takes UTF-8 only.
        raise ArgumentTypeError(f"{quoted(word)}: the {what} is not UTF-8; rename it") from None
