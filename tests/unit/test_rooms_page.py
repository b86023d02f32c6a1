"""The page of six rooms: its table is that of the stored results, and its pictures are there and small."""

from __future__ import annotations

import json
import re

from docs.pictures.rooms import IMAGES, LARGEST_BYTES, ROOMS
from docs.pictures.rooms_table import AFTER, BEFORE, COSTS, PAGE, TITLES, page_with_table

TEXT = PAGE.read_text(encoding="utf-8")
COST = json.loads(COSTS.read_text(encoding="utf-8"))["costs"]


def test_the_table_is_that_of_the_results() -> None:
    assert page_with_table(TEXT, COST) == TEXT


def test_every_room_was_measured_before_and_after() -> None:
    assert {room.name for room in ROOMS} == set(TITLES) == set(COST)
    for name, costs in COST.items():
        assert set(costs) == {BEFORE, AFTER}, name
        assert costs[AFTER]["own_texels"] > costs[BEFORE]["used_texels"], name
    commits = {when: {costs[when]["commit"] for costs in COST.values()} for when in (BEFORE, AFTER)}
    assert [len(found) for found in commits.values()] == [1, 1]


def test_every_room_is_shown_and_its_picture_is_small() -> None:
    shown = re.findall(r"\]\(images/rooms/([\w-]+)\.jpg\)", TEXT)
    assert sorted(shown) == sorted(room.name for room in ROOMS)
    files = {path.name: path.stat().st_size for path in IMAGES.iterdir()}
    assert set(files) == {f"{name}.jpg" for name in shown}
    assert max(files.values()) <= LARGEST_BYTES
    assert sum(files.values()) < 3_000_000
