"""Fake users and asset marks, which Blender does not copy with a datablock."""

from __future__ import annotations

from typing import cast

import bpy

_DETAILS = ("author", "description", "copyright", "license", "catalog_id")


def take_marks(target: bpy.types.ID | None, source: bpy.types.ID) -> None:
    """Give a datablock the fake user and the asset mark that another one has."""
    if target is None or target.library is not None:
        return
    if source.use_fake_user:
        target.use_fake_user = True
    if source.asset_data is None or target.asset_data is not None:
        return
    target.asset_mark()
    given, taken = source.asset_data, cast(bpy.types.AssetMetaData, target.asset_data)
    for name in _DETAILS:
        if hasattr(given, name):
            setattr(taken, name, getattr(given, name))
    for tag in given.tags:
        taken.tags.new(tag.name)


def move_marks(target: bpy.types.ID, source: bpy.types.ID) -> None:
    """The same, and take them off the other one."""
    take_marks(target, source)
    source.use_fake_user = False
    if source.asset_data is not None:
        source.asset_clear()
