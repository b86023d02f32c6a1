"""A new bake takes the earlier one's place only if it succeeds as a whole."""

from __future__ import annotations

import bpy
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.datablocks import bake_record
from tests.blender.file_dump import differences_since, tidy_dump
from tests.blender.hand_bake import bake_by_hand
from tests.blender.zoo import build_zoo

pytestmark = [pytest.mark.one_blender, pytest.mark.usefixtures("record")]


@pytest.mark.parametrize("baked_before", [False, True], ids=["first", "again"])
def test_a_bake_that_fails_after_it_is_shown_leaves_what_was_there(baked_before: bool) -> None:
    build_zoo(bpy.context)
    if baked_before:
        bake_by_hand()
    before = tidy_dump()
    with pytest.raises(BakeError, match="full"):
        bake_by_hand(colors=((9.0, 9.0, 9.0),), failing=BakeError("the disk is full"))
    assert differences_since(before, tidy_dump()) == []
    assert bake_record.is_baked() == baked_before


def test_a_bake_that_succeeds_replaces_the_earlier_one_and_restores_to_the_originals() -> None:
    build_zoo(bpy.context)
    before = tidy_dump()
    bake_by_hand()
    count = len(list(bake_record.made_datablocks()))
    bake_by_hand(colors=((9.0, 9.0, 9.0),))
    assert len(list(bake_record.made_datablocks())) == count
    assert not any(block.name.startswith(".earlier") for block in bpy.data.materials)
    restore(bpy.context)
    assert differences_since(before, tidy_dump()) == []
