"""Streams of random numbers: each use has its own, and all are listed."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

import radiosity_addon
from radiosity_addon.numerics.streams import SHARED, Stream


def test_no_number_is_used_twice_but_by_streams_that_are_documented() -> None:
    names = defaultdict(set)
    for name, stream in Stream.__members__.items():
        names[stream.value].add(name)
    assert {frozenset(same) for same in names.values() if len(same) > 1} == set(SHARED)
    assert all(SHARED.values())


def test_every_stream_is_listed_and_used() -> None:
    """No literal is added to a seed anywhere, and no stream is left over."""
    literal, used = [], set()
    for path in Path(radiosity_addon.__file__).parent.rglob("*.py"):
        if path.parent.name == "numerics":
            continue
        text = path.read_text(encoding="utf-8")
        literal += [f"{path.name}: {line}" for line in re.findall(r".*seed \+ \d.*", text)]
        used |= set(re.findall(r"\bStream\.([A-Z_]+)", text))
    assert literal == []
    assert used == set(Stream.__members__)
