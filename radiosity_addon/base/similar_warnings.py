"""Many warnings that say the same of different things, as few: a list that somebody will read.

A map of a hundred materials without their images would else push what matters out of sight.
The report has every warning; this is for consoles and panels.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

MAX_SINGLE = 3
"""So many of a kind are shown one by one."""

MAX_NAMED = 3
"""At most this many others are named after the first one of a kind."""

_PARTICULARS = re.compile(r"'[^']*'|\d+(?:[.,]\d+)*")
"""What differs between warnings of a kind: names and numbers."""


def one_of_each(warnings: Sequence[dict[str, str]]) -> list[dict[str, str]]:
    """Return the warnings to show, in the order in which each kind first came.

    warnings: The report's: "name", of what it is about, and "message".
    Returns shown: Of more than `MAX_SINGLE` that differ only in names and numbers, the first, with the
        number of the others.
    """
    kinds: dict[str, list[dict[str, str]]] = {}
    for warning in warnings:
        kinds.setdefault(_PARTICULARS.sub("…", warning["message"]), []).append(warning)
    shown = []
    for alike in kinds.values():
        shown += alike if len(alike) <= MAX_SINGLE else [_first_of(alike)]
    return shown


def _first_of(alike: Sequence[dict[str, str]]) -> dict[str, str]:
    """Return the first of a kind, with how many others there are and whose some of them are."""
    first, *others = alike
    names = list(dict.fromkeys(warning["name"] for warning in others if warning["name"] != first["name"]))
    rest = f"{len(others)} more like this in the report"
    if names:
        rest += f", of {', '.join(names[:MAX_NAMED])}{' …' if len(names) > MAX_NAMED else ''}"
    return {"name": first["name"], "message": f"{first['message']} ({rest})"}
