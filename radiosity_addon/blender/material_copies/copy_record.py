"""Digests on a lightmap copy of what it was when it was made, by which edits are known later."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from ..datablocks.bake_record import ORIGINAL
from .copy_marks import CONTENT, SOURCE, STATE, copied_groups
from .material_digest import digest_of_material, tree_digest


def record(copy: bpy.types.Material) -> Callable[[], None]:
    """Note what a fresh copy holds; the result completes the record once the lightmap is wired in."""
    original = copy.get(ORIGINAL)
    copy[CONTENT] = digest_of_material(copy)
    copy[SOURCE] = "" if original is None else digest_of_material(original)

    def complete() -> None:
        for group in dict.fromkeys(copied_groups(copy.node_tree)):
            group[SOURCE] = group[CONTENT] = tree_digest(group[ORIGINAL])
            group[STATE] = tree_digest(group, as_copy=True)
        copy[STATE] = digest_of_material(copy, as_copy=True)

    return complete


def is_untouched(copy: bpy.types.Material) -> bool:
    """Whether a copied material is as it was recorded; its node groups are not looked into."""
    return copy.get(STATE) == digest_of_material(copy, as_copy=True)
