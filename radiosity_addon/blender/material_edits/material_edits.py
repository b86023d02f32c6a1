"""Carry edits of the lightmap copies of materials to the originals: what is seen is what is edited.

Restore, exports and comparisons call `carry_material_edits` first, and treat the originals as the truth then.
"""

from __future__ import annotations

import re
import uuid
from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

from ...base import BakeWarning
from ..datablocks.asset_marks import take_marks
from ..datablocks.bake_record import ORIGINAL, is_made
from ..material_copies.copy_marks import (
    CARRIED,
    CONTENT,
    COPY_NAME,
    NO_MATERIAL,
    PLAIN,
    SOURCE,
    STATE,
    SUFFIX,
    TOKEN,
    copied_groups,
)
from ..material_copies.followed_values import overruled
from ..material_copies.material_digest import digest_of_material, tree_digest
from ..materials.materials import uses_nodes
from .copy_values import take_values, write_material, write_settings, write_tree
from .legacy_copies import is_legacy, was_edited
from .stripping import stripped_copy, stripped_group


def carry_material_edits() -> tuple[BakeWarning, ...]:
    """Make every original equal to what the user made of its lightmap copy.

    An edit goes to the original. That stays the datablock it is if the nodes are still the same; else it is
    replaced everywhere by a datablock with the new nodes. The copy's content becomes a material of its own
    where the original was edited too, where another copy of it was edited differently, and where it is linked
    from a library. Afterward `radiosity_original` of each copy is the material that holds what it shows.

    Returns warnings: Of the materials that became others' own, by name.
    """
    copies = [block for block in bpy.data.materials if _is_copy(block)]
    warnings: list[BakeWarning] = []
    for group in dict.fromkeys(group for copy in copies for group in copied_groups(copy.node_tree)):
        warnings += _carry_group(group)
    duplicates = _duplicates(copies)
    for copy in copies:
        warnings += _carry(copy, copy in duplicates)
    return tuple(warnings)


def _is_copy(material: bpy.types.Material) -> bool:
    return material.library is None and is_made(material) and material.node_tree is not None


def _carry(copy: bpy.types.Material, is_duplicate: bool) -> list[BakeWarning]:
    """Carry the edits of one copy."""
    if is_legacy(copy):
        return _carry_legacy(copy)
    warnings = [
        BakeWarning(
            copy.name,
            f"material '{copy.name}': its node '{name}' follows the animation of the original, so keyframes "
            "and drivers set on the node are not kept: set them on the shader's input after Restore",
        )
        for name in overruled(copy.node_tree)
    ]
    original = copy.get(ORIGINAL)
    shown, edited = copy.name, copy[STATE] != digest_of_material(copy, as_copy=True)
    if not edited and not is_duplicate and copy.name == copy[COPY_NAME]:
        take_marks(original, copy)
        return warnings
    renamed = _base_name(copy.name) != _base_name(copy[COPY_NAME])
    if edited or is_duplicate or (renamed and original is None):
        stripped, complete = stripped_copy(copy)
        content = digest_of_material(stripped)
        if not complete:
            message = (
                f"material '{shown}': its shader cannot take what feeds the lightmap's node: edit the shader"
            )
            warnings.append(BakeWarning(shown, message))
        same = content == copy[CONTENT] or (original is not None and content == digest_of_material(original))
        if same and not (is_duplicate and copy.users) and not (renamed and original is None):
            bpy.data.materials.remove(stripped)
            if content != copy[CONTENT]:
                copy[CONTENT], copy[SOURCE] = content, digest_of_material(original)
        elif original is None or is_duplicate:
            name = _name_of_own(copy) if original is None else original.name
            original = _as_own(copy, stripped, name, content)
        elif original.library is None and digest_of_material(original) == copy[SOURCE]:
            original = _move(copy, original, stripped, content)
        else:
            own = _as_own(copy, stripped, original.name, content)
            warnings.append(_conflict("material", original, own))
            original = own
        copy[STATE] = digest_of_material(copy, as_copy=True)
    if original is not None and original.library is None and renamed:
        name = _base_name(copy.name)
        copy.name = f"{name}{SUFFIX}"  # or the original could not have it
        original.name = name
    copy[COPY_NAME] = copy.name
    take_marks(original, copy)
    return warnings


def _move(
    copy: bpy.types.Material, original: bpy.types.Material, stripped: bpy.types.Material, content: str
) -> bpy.types.Material:
    """Give an original what was made of its copy; returns it, or what replaced it."""
    before = copy[SOURCE]
    written = False
    if not uses_nodes(original):
        written = _write_plain(original, stripped)
    elif write_material(original, stripped):
        written = digest_of_material(original) == content
    if written:
        bpy.data.materials.remove(stripped)
    else:
        original = _replace(bpy.data.materials, original, stripped)
    copy[CONTENT], copy[SOURCE] = content, digest_of_material(original)
    for other in [block for block in bpy.data.materials if _is_copy(block) and block != copy]:
        if other.get(ORIGINAL) == original and other.get(SOURCE) == before:
            _follow(other, original)
    return original


def _follow(copy: bpy.types.Material, original: bpy.types.Material) -> None:
    """Have another copy of an original that was just edited show it, if it was not edited itself."""
    if copy[STATE] != digest_of_material(copy, as_copy=True) or copy.get(PLAIN):
        return
    take_values(copy.node_tree, original.node_tree)
    stripped, _ = stripped_copy(copy)
    if digest_of_material(stripped) == digest_of_material(original):
        copy[CONTENT] = copy[SOURCE] = digest_of_material(original)
    copy[STATE] = digest_of_material(copy, as_copy=True)
    bpy.data.materials.remove(stripped)


def _write_plain(original: bpy.types.Material, stripped: bpy.types.Material) -> bool:
    """Give a material without nodes its color; False where it needs nodes now."""
    nodes = list(stripped.node_tree.nodes)
    if sorted(node.type for node in nodes) != ["BSDF_DIFFUSE", "OUTPUT_MATERIAL"]:
        return False
    (shader,) = (node for node in nodes if node.type == "BSDF_DIFFUSE")
    if len(stripped.node_tree.links) != 1 or shader.inputs["Roughness"].default_value != 0.0:
        return False
    before, color = tuple(original.diffuse_color), tuple(shader.inputs["Color"].default_value)
    written = write_settings(original, stripped)
    if not np.allclose(before[:3], color[:3]):
        original.diffuse_color = (*color[:3], original.diffuse_color[3])
    return written


def _as_own(
    copy: bpy.types.Material, stripped: bpy.types.Material, name: str, content: str
) -> bpy.types.Material:
    """Make what a copy holds a material of the user's, and the copy one of it."""
    stripped.name = name
    stripped.use_fake_user = True  # it may be that nothing shows it for a while
    copy[ORIGINAL] = stripped
    copy[TOKEN] = uuid.uuid4().hex
    copy.pop(PLAIN, None)
    copy[CONTENT], copy[SOURCE] = content, digest_of_material(stripped)
    return stripped


def _name_of_own(copy: bpy.types.Material) -> str:
    """Return what to call the material that a copy of none, or of one that was deleted, becomes."""
    name = _base_name(copy.name)
    return "Material" if name == _base_name(NO_MATERIAL) else name


def _carry_group(copy: bpy.types.NodeTree) -> list[BakeWarning]:
    """Carry the edits of our copy of a node group."""
    if copy.get(STATE) is None or copy[STATE] == tree_digest(copy, as_copy=True):
        return []
    original = copy[ORIGINAL]
    stripped = stripped_group(copy)
    content = tree_digest(stripped)
    warnings: list[BakeWarning] = []
    if content in (copy[CONTENT], tree_digest(original)):
        bpy.data.node_groups.remove(stripped)
    elif original.library is None and tree_digest(original) == copy[SOURCE]:
        if write_tree(original, stripped) and tree_digest(original) == content:
            bpy.data.node_groups.remove(stripped)
        else:
            original = _replace(bpy.data.node_groups, original, stripped)
        copy[CONTENT] = copy[SOURCE] = content
    else:
        stripped.name = original.name
        copy[ORIGINAL] = stripped
        copy[CONTENT] = copy[SOURCE] = content
        warnings.append(_conflict("node group", original, stripped))
    copy[STATE] = tree_digest(copy, as_copy=True)
    return warnings


def _carry_legacy(copy: bpy.types.Material) -> list[BakeWarning]:
    """Carry the edits of a copy that a version made which noted nothing on copies."""
    content = digest_of_material(copy)
    if copy.get(CARRIED) == content:
        return []
    copy[CARRIED] = content
    original = copy.get(ORIGINAL)
    own, edited = was_edited(copy)
    if not edited:
        bpy.data.materials.remove(own)
        return []
    own.name = "Material" if original is None else original.name
    own.use_fake_user = True
    copy[ORIGINAL] = own
    return [] if original is None else [_conflict("material", original, own)]


def _replace(blocks: Any, original: bpy.types.ID, by: bpy.types.ID) -> bpy.types.ID:
    """Put a datablock in the place of another, which is removed: its name, its users and what marks it."""
    name = original.name
    original.user_remap(by)
    take_marks(by, original)
    blocks.remove(original)
    by.name = name
    return by


def _conflict(kind: str, original: bpy.types.ID, own: bpy.types.ID) -> BakeWarning:
    reason = "is linked from a library" if original.library is not None else "was edited differently, too"
    message = (
        f"{kind} '{original.name}' was edited on its lightmap copy, and {reason}: "
        f"the copy's edits are in '{own.name}'"
    )
    return BakeWarning(own.name, message)


def _duplicates(copies: Sequence[bpy.types.Material]) -> set[bpy.types.Material]:
    """Return the copies that the user duplicated from others."""
    of_token: dict[str, list[bpy.types.Material]] = {}
    for copy in copies:
        if copy.get(TOKEN) is not None:
            of_token.setdefault(copy[TOKEN], []).append(copy)
    found: set[bpy.types.Material] = set()
    for same in of_token.values():
        # The first is the one that has kept its name, if it is still there.
        same.sort(key=lambda copy: (copy.name != copy[COPY_NAME], copy.name))
        found.update(same[1:])
    return found


def _base_name(name: str) -> str:
    """Return the original's name as a copy's name has it, without the number that Blender gave the copy."""
    head, suffix, rest = name.rpartition(SUFFIX)
    return head if suffix and re.fullmatch(r"(\.\d+)?", rest) else name
